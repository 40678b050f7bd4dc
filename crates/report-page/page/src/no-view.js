// In place of the scene where a browser cannot draw it (no WebGL 2).

import { h, put } from './dom.js';

export class NoView {
  constructor(parent, error) {
    this.frameMode = 'part';
    this.groups = { path: { label: 'Path', isShown: false }, rapids: { label: 'Rapids', isShown: false } };
    this.k = -1;
    this.renderer = { domElement: h('div') };
    put(parent, h('.no-view', { role: 'alert' }, h('b', 'No picture: '), `this browser cannot draw the scene (WebGL 2): ${error && error.message ? error.message : error}. Program, findings, plots and setup sheet are complete.`));
  }

  setPosition(q, k) {
    [this.q, this.k] = [q, k];
  }

  setVisible(name, isShown) {
    if (this.groups[name]) this.groups[name].isShown = isShown;
  }

  setFrameMode(mode) {
    this.frameMode = mode;
  }

  frameLabels() {
    return [];
  }

  pointAt() {
    return null;
  }

  motionAt() {
    return -1;
  }

  addStock() {}

  addNarrowPoints() {}

  narrowPointAt() {
    return -1;
  }

  setPathDone() {}

  setSection() {}

  setTheme() {}

  setMarks() {}

  colourPath() {}

  colourPart() {}

  highlight() {}

  look() {}

  draw() {}

  prepareMotion() {}

  drawNow() {}
}
