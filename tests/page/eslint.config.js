// How the page's scripts are written. What TypeScript finds is not looked for again.

import globals from "globals";

const rules = {
  "array-callback-return": "error",
  complexity: ["error", 20],
  eqeqeq: "error",
  "func-style": ["error", "declaration", { allowArrowFunctions: true }],
  "max-depth": ["error", 4],
  "max-len": ["error", { code: 140 }],
  "max-lines": ["error", 400],
  "max-lines-per-function": ["error", 60],
  "no-constant-condition": "error",
  "no-dupe-keys": "error",
  "no-implicit-globals": "error",
  "no-nested-ternary": "error",
  "no-self-compare": "error",
  "no-shadow": "error",
  "no-undef": "error",
  "no-unneeded-ternary": "error",
  "no-unreachable": "error",
  "no-unused-expressions": "error",
  "no-unused-vars": ["error", { argsIgnorePattern: "^_" }],
  "no-use-before-define": ["error", { functions: false, classes: false, variables: false }],
  "no-useless-return": "error",
  "no-var": "error",
  "object-shorthand": "error",
  "prefer-const": "error",
  "prefer-template": "error",
  "require-await": "error",
};

export default [
  { ignores: ["**/node_modules/"] },
  { linterOptions: { reportUnusedDisableDirectives: "error" } },
  { files: ["cmmlink/console/static/*.js"], languageOptions: { globals: globals.browser }, rules },
  { files: ["tests/page/*.js"], languageOptions: { globals: globals.node }, rules },
];
