// Entry of the setup sheet alone.

import { readDocument } from './data.js';
import { h, put } from './dom.js';
import { sheet } from './sheet-content.js';
import { setInch } from './units.js';

const doc = readDocument();
const show = (inch) => {
  setInch(inch);
  const bar = h('nav.sheet-bar', h('button', { onclick: () => show(!inch) }, inch ? 'inch → mm' : 'mm → inch'), h('button', { onclick: () => window.print() }, 'Print'));
  put(document.getElementById('app'), bar, sheet(doc));
};
document.body.className = 'sheet-page';
show(false);
