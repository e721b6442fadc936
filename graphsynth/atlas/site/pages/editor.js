// Drawing a chain by hand: pivots on a sheet, links through them, by mouse, touch or keyboard.
"use strict";

(function () {
  const WIDE = 560, TALL = 340, STEP = 20, NEAR = 16;
  const letter = k => (k < 26 ? String.fromCharCode(65 + k) : letter(Math.floor(k / 26) - 1) + letter(k % 26));
  const EXAMPLE = {
    pivots: [[80, 280], [120, 140], [260, 80], [300, 200], [240, 280], [420, 120], [480, 280]],
    links: [[0, 4, 6], [0, 1], [1, 2], [2, 3, 5], [3, 4], [5, 6]], frame: 0,
  };

  Atlas.Editor = class {
    /** `told` is called with {graph, names, frame} or {words} after every change. */
    constructor(place, told) {
      Object.assign(this, {place, told, pivots: [], links: [], frame: null, open: null, cursor: [WIDE / 2, TALL / 2], past: [], drag: null});
      place.innerHTML = Atlas.html`<div class="tools" role="toolbar" aria-label="Drawing">
<button type="button" data-do="end">End link</button> <button type="button" data-do="undo">Undo</button>
<button type="button" data-do="clear">Clear</button> <button type="button" data-do="example">Example</button></div>
<svg class="sheet" viewBox="0 0 ${WIDE} ${TALL}" tabindex="0" role="application" aria-label="Sheet: arrows move the cross, Enter puts a pivot or takes one, E ends the link, Delete removes, Shift and arrows move a pivot" aria-describedby="sheethelp"></svg>
<p id="sheethelp" class="soft">Click pivots one after another to draw a link through them; click the last one again, or End link, to end it. A pivot shared by two links is a joint. Drag to move. On the keyboard: arrows, Enter, <kbd>E</kbd>, <kbd>Delete</kbd>, Shift with arrows.</p>
<div class="aslist"><label>The same in letters, one group of pivots for each link<input type="text" name="letters" spellcheck="false" autocomplete="off" placeholder="AB BC CD AD"></label></div>
<ul class="drawn"></ul><p class="said" aria-live="polite"></p>`;
      this.sheet = place.querySelector(".sheet");
      this.letters = place.querySelector("[name=letters]");
      place.querySelector(".tools").addEventListener("click", event => { const act = event.target.dataset.do; if (act) this[act](); });
      place.querySelector(".drawn").addEventListener("click", event => {
        const k = event.target.dataset.remove;
        if (k !== undefined) { this.keep(); this.removeLink(+k); this.show(); }
      });
      place.querySelector(".drawn").addEventListener("change", event => { this.keep(); this.frame = event.target.checked ? +event.target.value : null; this.show(); });
      this.letters.addEventListener("input", () => this.fromLetters());
      this.sheet.addEventListener("pointerdown", event => this.down(event));
      this.sheet.addEventListener("pointermove", event => this.move(event));
      this.sheet.addEventListener("pointerup", event => this.up(event));
      this.sheet.addEventListener("keydown", event => this.key(event));
      this.show();
    }

    keep() {
      this.past.push(JSON.stringify([this.pivots, this.links, this.frame, this.open]));
      if (this.past.length > 200) this.past.shift();
    }
    undo() {
      if (!this.past.length) return;
      [this.pivots, this.links, this.frame, this.open] = JSON.parse(this.past.pop());
      this.show();
    }
    clear() { this.keep(); Object.assign(this, {pivots: [], links: [], frame: null, open: null}); this.show(); }
    example() { this.keep(); Object.assign(this, structuredClone(EXAMPLE), {open: null}); this.show(); }

    at(point) {
      let best = -1, least = NEAR;
      this.pivots.forEach(([x, y], k) => {
        const d = Math.hypot(x - point[0], y - point[1]);
        if (d < least) { least = d; best = k; }
      });
      return best;
    }

    /** A click: take the pivot there, or put one, and lead the open link through it. */
    press(point) {
      this.keep();
      let k = this.at(point);
      if (k < 0) k = this.pivots.push(point) - 1;
      if (this.open === null) this.open = [k];
      else if (this.open[this.open.length - 1] === k || (this.open[0] === k && this.open.length > 2)) { this.end(); return; }
      else if (!this.open.includes(k)) this.open.push(k);
      this.show();
    }

    end() {
      if (this.open && this.open.length > 1) this.links.push(this.open);
      this.open = null;
      this.tidy();
      this.show();
    }

    /** Forget pivots that no link goes through. */
    tidy() {
      const used = new Set([...this.links.flat(), ...(this.open || [])]), to = new Map();
      this.pivots = this.pivots.filter((_, k) => used.has(k) && to.set(k, to.size));
      this.links = this.links.map(link => link.map(k => to.get(k)));
      if (this.open) this.open = this.open.map(k => to.get(k));
    }

    removeLink(k) {
      this.links.splice(k, 1);
      if (this.frame === k) this.frame = null;
      else if (this.frame !== null && this.frame > k) this.frame--;
      this.tidy();
    }

    removePivot(k) {
      if (k < 0) return;
      this.keep();
      const without = list => list.filter(one => one !== k), frame = this.frame === null ? null : this.links[this.frame];
      const kept = this.links.filter(link => without(link).length > 1);
      this.frame = kept.includes(frame) ? kept.indexOf(frame) : null;
      this.links = kept.map(without);
      if (this.open) this.open = without(this.open).length ? without(this.open) : null;
      this.tidy();
      this.show();
    }

    // --- pointer and keyboard

    point(event) {
      const m = this.sheet.getScreenCTM().inverse();
      const x = m.a * event.clientX + m.e, y = m.d * event.clientY + m.f;
      return [Math.round(Math.min(Math.max(x, 8), WIDE - 8)), Math.round(Math.min(Math.max(y, 8), TALL - 8))];
    }
    down(event) {
      if (event.button) return;
      const point = this.point(event);
      this.cursor = point;
      this.drag = {k: this.at(point), from: point, moved: false};
      this.sheet.setPointerCapture(event.pointerId);
    }
    move(event) {
      if (!this.drag || this.drag.k < 0) return;
      const point = this.point(event);
      if (!this.drag.moved && Math.hypot(point[0] - this.drag.from[0], point[1] - this.drag.from[1]) < 5) return;
      if (!this.drag.moved) this.keep();
      this.drag.moved = true;
      this.pivots[this.drag.k] = this.cursor = point;
      this.draw();
    }
    up(event) {
      const drag = this.drag;
      this.drag = null;
      if (drag && !drag.moved) this.press(this.point(event));
      else if (drag) this.show();
    }
    key(event) {
      const way = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[event.key];
      const lower = event.key.toLowerCase();
      if (way) {
        const held = event.shiftKey ? this.at(this.cursor) : -1;
        this.cursor = [0, 1].map(i => Math.min(Math.max(this.cursor[i] + way[i] * STEP, STEP), (i ? TALL : WIDE) - STEP));
        if (held >= 0) { this.keep(); this.pivots[held] = this.cursor.slice(); this.show(); }
        const under = this.at(this.cursor);
        if (under >= 0) this.say(`pivot ${letter(under)}`);
        this.draw();
      } else if (event.key === "Enter" || event.key === " ") this.press(this.cursor.slice());
      else if (lower === "e" && !event.ctrlKey && !event.metaKey) this.end();
      else if (lower === "z" && (event.ctrlKey || event.metaKey)) this.undo();
      else if (event.key === "Delete" || event.key === "Backspace") this.removePivot(this.at(this.cursor));
      else if (event.key === "Escape") { if (this.open) { this.keep(); this.open = null; this.tidy(); this.show(); } else return; }
      else return;
      event.preventDefault();
    }

    fromLetters() {
      const words = this.letters.value.toUpperCase().split(/[^A-Z]+/).filter(Boolean);
      this.keep();
      const names = [...new Set(words.join(""))].sort(), old = this.pivots;
      this.pivots = names.map((name, k) => old[name.charCodeAt(0) - 65] || [
        Math.round(WIDE / 2 + 130 * Math.cos(2 * Math.PI * k / Math.max(names.length, 3))),
        Math.round(TALL / 2 + 130 * Math.sin(2 * Math.PI * k / Math.max(names.length, 3)))]);
      this.links = words.map(word => [...new Set(word)].map(name => names.indexOf(name))).filter(link => link.length > 1);
      if (this.frame !== null && this.frame >= this.links.length) this.frame = null;
      this.open = null;
      this.show(true);
    }

    // --- what is shown and told

    say(words) { this.place.querySelector(".said").textContent = words; }

    show(typing = false) {
      if (!typing) this.letters.value = this.links.map(link => link.map(letter).join("")).join(" ");
      this.place.querySelector(".drawn").innerHTML = Atlas.html`${this.links.map((link, k) =>
        Atlas.html`<li><span>link ${k}: ${link.map(letter).join(" ")}</span> <label><input type="checkbox" value="${k}"${this.frame === k ? " checked" : ""}> frame</label>
<button type="button" data-remove="${k}" aria-label="Remove link ${k}">remove</button></li>`)}`;
      this.draw();
      this.told(this.result());
    }

    draw() {
      const path = list => "M" + list.map(k => this.pivots[k].join(" ")).join("L");
      const round = list => { // corners in the order of a simple outline
        const cx = list.reduce((s, k) => s + this.pivots[k][0], 0) / list.length, cy = list.reduce((s, k) => s + this.pivots[k][1], 0) / list.length;
        return list.slice().sort((p, q) => Math.atan2(this.pivots[p][1] - cy, this.pivots[p][0] - cx) - Math.atan2(this.pivots[q][1] - cy, this.pivots[q][0] - cx));
      };
      const uses = this.pivots.map((_, k) => this.links.filter(link => link.includes(k)).length);
      const grid = `<defs><pattern id="grid" width="${STEP}" height="${STEP}" patternUnits="userSpaceOnUse"><circle cx="0" cy="0" r="1" fill="var(--soft)" fill-opacity=".5"/></pattern></defs><rect width="${WIDE}" height="${TALL}" fill="url(#grid)"/>`;
      const links = this.links.map((link, k) => {
        const style = k === this.frame ? 'stroke="var(--soft)" stroke-dasharray="2 4"' : 'stroke="var(--ink)"';
        return `<path d="${path(round(link))}${link.length > 2 ? "Z" : ""}" fill="${link.length > 2 ? "var(--fill)" : "none"}" fill-opacity=".8" ${style} stroke-width="3.2" stroke-linejoin="round" stroke-linecap="round"/>`;
      });
      const open = this.open ? `<path d="${path(this.open)}${this.open.length === 1 ? "h.01" : ""}" fill="none" stroke="var(--g1)" stroke-width="4" stroke-linecap="round" stroke-linejoin="round"/>` : "";
      const pivots = this.pivots.map(([x, y], k) =>
        `<circle cx="${x}" cy="${y}" r="6" fill="${uses[k] === 2 ? "var(--paper)" : uses[k] > 2 ? "var(--drive)" : "var(--soft)"}" stroke="var(--ink)" stroke-width="1.8"/>` +
        `<text x="${x + 10}" y="${y - 9}" font-size="13" fill="var(--ink)" stroke="var(--paper)" stroke-width="3" paint-order="stroke">${letter(k)}</text>`);
      const [x, y] = this.cursor;
      const cross = `<path class="cross" d="M${x - 9} ${y}h18M${x} ${y - 9}v18" stroke="var(--drive)" stroke-width="1.6"/>`;
      this.sheet.innerHTML = Atlas.drawn(grid + links.join("") + open + pivots.join("") + cross);
    }

    result() {
      if (!this.links.length) return {words: ""};
      const joints = [], loose = [];
      for (let k = 0; k < this.pivots.length; k++) {
        const on = this.links.map((link, n) => n).filter(n => this.links[n].includes(k));
        if (on.length === 2) joints.push(on);
        else if (on.length === 1) loose.push(letter(k));
        else if (on.length > 2) return {words: `${on.length} links meet in pivot ${letter(k)}: draw it as ${on.length - 1} joints beside one another.`};
      }
      try {
        return {graph: Atlas.graph(this.links.length, joints, this.frame), words: loose.length ? `Pivots on one link are no joints: ${loose.join(", ")}.` : ""};
      } catch (fault) {
        if (fault instanceof Atlas.Fault) return {words: fault.message};
        throw fault;
      }
    }
  };
})();
