// Written by `node tests/page/catalogue.js`: the page's own language, and those there is a catalogue of.

export const LANGUAGES = ["en", "de"];
