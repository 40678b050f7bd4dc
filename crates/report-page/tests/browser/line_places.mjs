// Asks the page's own script where lines of a program with subprograms are written; prints JSON.
// `node line_places.mjs`, without a browser.

import { linePlace, linePlaces, writtenPlace } from '../../page/src/lines.js';

const written = [
  { first_line: 1, file: 'main.nc', line: 1 },
  { first_line: 5, file: 'O2.nc', line: 3 },
  { first_line: 8, file: 'main.nc', line: 6 },
];
const doc = { program: { written } };
const flat = { program: {} };
console.log(JSON.stringify({
  places: [1, 4, 5, 7, 8, 20].map((line) => writtenPlace(written, line)).map(({ file, line }) => `${file} ${line}`),
  flat: [writtenPlace(undefined, 3), writtenPlace([], 3), linePlace(flat, 3), linePlaces(flat, 3, 4)],
  one: linePlace(doc, 6),
  ranges: [linePlaces(doc, 5, 7), linePlaces(doc, 4, 5)],
}));
