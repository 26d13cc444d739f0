// What the station makes of recorded runs, saved as files by the browser: an archive, a report, two runs on one drawing.

import { selectOf } from "./dom.js";
import { OUT_OF_REACH } from "./link.js";
import { gettext } from "./words.js";

/** @import { Outcome } from "./link.js" */

export class Downloads {
  /**
   * @param {() => string} token
   * @param {(outcome: Outcome) => void} say
   */
  constructor(token, say) {
    this.token = token;
    this.say = say;
    this.toCompare = ""; // the run that was chosen first
  }

  /** @param {string} run */
  export(run) {
    return this.download(`/export/${encodeURIComponent(run)}`, `${run}.zip`);
  }

  /**
   * Save the report of a recorded run, which the station makes now, in the language and on the paper that are chosen.
   * @param {string} run
   */
  report(run) {
    const chosen = ["language", "paper"].map((name) => `${name}=${selectOf(`report-${name}`).value}`);
    this.say({ ok: true, message: gettext("making the report \u2026") });
    return this.download(`/report/${encodeURIComponent(run)}?${chosen.join("&")}`, `${run}.pdf`);
  }

  /**
   * Take a run as the first one to compare, or draw the one that was taken before and this one.
   * @param {string} run
   */
  compare(run) {
    const first = this.toCompare === run ? "" : this.toCompare;
    this.toCompare = first ? "" : run;
    if (!first) return this.say({ ok: true, message: gettext("{run} is the first one: choose the other run and press C again", { run }) });
    this.say({ ok: true, message: gettext("drawing both runs \u2026") });
    return this.download(`/compare/${encodeURIComponent(first)}/${encodeURIComponent(run)}`, `${first}-${run}.pdf`);
  }

  /**
   * Save a file of the station.
   * @param {string} address
   * @param {string} name
   */
  async download(address, name) {
    try {
      const answer = await fetch(address, { headers: { Authorization: `Bearer ${this.token()}` } });
      if (!answer.ok) return this.say({ ok: false, message: await answer.text() });
      save(await answer.blob(), name);
      this.say({ ok: true, message: gettext("{name} saved", { name }) });
    } catch {
      this.say({ ok: false, message: gettext("{name} was not saved: {cause}", { name, cause: OUT_OF_REACH }) });
    }
  }
}

/**
 * @param {Blob} content
 * @param {string} name
 */
function save(content, name) {
  const address = URL.createObjectURL(content), anchor = document.createElement("a");
  anchor.href = address;
  anchor.download = name;
  anchor.click();
  URL.revokeObjectURL(address);
}
