// Tells node that the page's scripts are modules, as the browser is told by index.html. Node 18 would take them for CommonJS.

import { register } from "node:module";

const hook = `export async function load(url, context, next) {
  return next(url, url.includes("/console/static/") ? { ...context, format: "module" } : context);
}`;

register(`data:text/javascript,${encodeURIComponent(hook)}`);
