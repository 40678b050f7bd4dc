// The time of the program as a strip: rapids, the figure of the path, faults, and the moment shown.

import { css } from './scales.js';

export class Timeline {
  constructor(parent, page, onseek) {
    this.parent = parent;
    this.page = page;
    this.canvas = document.createElement('canvas');
    this.cursor = document.createElement('canvas');
    parent.append(this.canvas, this.cursor);
    this.time = 0;
    const seek = (event) => {
      const box = this.cursor.getBoundingClientRect();
      onseek((Math.min(Math.max(event.clientX - box.left, 0), box.width) / box.width) * page.motion.total);
    };
    this.cursor.addEventListener('pointerdown', (event) => {
      this.cursor.setPointerCapture(event.pointerId);
      page.play(false);
      seek(event);
    });
    this.cursor.addEventListener('pointermove', (event) => event.buttons && seek(event));
    new ResizeObserver(() => this.draw()).observe(parent);
  }

  fit(canvas) {
    const { clientWidth: width, clientHeight: height } = this.parent;
    canvas.width = Math.max(1, width);
    canvas.height = Math.max(1, height);
    return { context: canvas.getContext('2d'), width, height };
  }

  draw() {
    const { page } = this;
    const { motion } = page;
    const { context, width, height } = this.fit(this.canvas);
    if (!width || !page.pathColour) return;
    const style = getComputedStyle(document.documentElement);
    context.fillStyle = style.getPropertyValue('--faint').trim();
    context.fillRect(0, 0, width, height);
    const total = motion.total || 1;
    for (let x = 0; x < width && motion.n; x++) {
      const { k } = motion.at(((x + 0.5) / width) * total);
      const isRapid = motion.kinds[k] === 0;
      context.fillStyle = isRapid ? style.getPropertyValue('--line').trim() : css(page.pathColour(k));
      context.fillRect(x, isRapid ? height * 0.5 : height * 0.28, 1, isRapid ? height * 0.25 : height * 0.5);
    }
    context.fillStyle = '#b3261e';
    for (const [line, mark] of page.lineMarks()) {
      if (mark.kind !== 'fault') continue;
      const k = motion.ofLine(line);
      const x = k < 0 ? 0 : (motion.endTimes[k] / total) * width;
      context.fillRect(Math.min(Math.max(x - 1, 0), width - 3), 0, 3, height);
    }
    this.drawCursor();
  }

  setTime(time) {
    this.time = time;
    this.drawCursor();
  }

  drawCursor() {
    const { context, width, height } = this.fit(this.cursor);
    const x = (this.time / (this.page.motion.total || 1)) * width;
    context.fillStyle = getComputedStyle(document.documentElement).getPropertyValue('--cursor').trim();
    context.fillRect(Math.min(Math.max(x - 1, 0), width - 2), 0, 2.5, height);
    context.beginPath();
    context.arc(Math.min(Math.max(x, 5), width - 5), 6, 5, 0, 7);
    context.fill();
  }
}
