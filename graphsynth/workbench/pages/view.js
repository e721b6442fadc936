// The drawing on the screen: a camera, layers of SVG, and the pose in which the links are shown.
"use strict";

(function () {
  const svg = Bench.svg;

  Bench.View = class {
    constructor(root) {
      this.root = root;
      this.camera = { x: 0, y: 0, scale: 2 };
      this.width = this.height = 1;
      this.layers = {};
      for (const name of ["under", "grid", "target", "links", "curves", "marks", "points", "motion", "binding", "over"]) {
        root.append(this.layers[name] = svg("g", { "data-layer": name }));
      }
      this.pose = null;
      this.shown = new WeakMap();
    }

    resize() {
      const box = this.root.getBoundingClientRect();
      this.width = Math.max(1, box.width);
      this.height = Math.max(1, box.height);
      this.root.setAttribute("viewBox", `0 0 ${this.width} ${this.height}`);
    }

    /** Place of the drawing to pixels, and back. */
    px([x, y]) {
      const { camera } = this;
      return [this.width / 2 + (x - camera.x) * camera.scale, this.height / 2 - (y - camera.y) * camera.scale];
    }
    place([x, y]) {
      const { camera } = this;
      return { x: camera.x + (x - this.width / 2) / camera.scale, y: camera.y - (y - this.height / 2) / camera.scale };
    }

    /** Show a box, with a margin, above the pixels that are covered; a drawing of one point is shown at the scale there is. */
    fit(box, covered = 0) {
      if (!box) return;
      const wide = box[2] - box[0], high = box[3] - box[1], free = Math.max(1, this.height - covered);
      const room = 0.68, scale = Math.min((this.width * room) / (wide || 1e-9), (free * (covered ? 0.8 : room)) / (high || 1e-9));
      if (wide || high) this.camera.scale = Math.min(1e9, Math.max(1e-6, scale));
      this.camera.x = (box[0] + box[2]) / 2;
      this.camera.y = (box[1] + box[3]) / 2 - covered / (2 * this.camera.scale);
    }

    /** Whether a box is seen whole, above what is covered at the bottom. */
    holds(box, covered = 0) {
      const [left, low] = this.px([box[0], box[1]]), [right, top] = this.px([box[2], box[3]]);
      return left >= 0 && top >= 0 && right <= this.width && low <= this.height - covered;
    }

    /** Zoom about a place in pixels. */
    zoom(factor, [x, y]) {
      const before = this.place([x, y]);
      this.camera.scale = Math.min(1e9, Math.max(1e-6, this.camera.scale * factor));
      const after = this.place([x, y]);
      this.camera.x += before.x - after.x;
      this.camera.y += before.y - after.y;
    }

    row(sheet, link) {
      const k = 3 * Bench.linkNumber(sheet, link);
      return this.pose && k + 2 < this.pose.length ? [this.pose[k], this.pose[k + 1], this.pose[k + 2]] : [0, 0, 0];
    }

    /** Where a point is now, in the drawing and in pixels; on a joint, as its first link carries it. */
    now(sheet, id) {
      const point = sheet.points[id], carrier = this.carrier.get(id);
      return carrier ? Bench.carried(this.row(sheet, carrier), [point.x, point.y]) : [point.x, point.y];
    }
    where(sheet, id) { return this.px(this.now(sheet, id)); }
    shape(sheet, link) {
      const row = this.row(sheet, link);
      return Bench.hull(Bench.shapeOf(sheet, link).map(at => this.px(Bench.carried(row, at))));
    }

    /** Build everything anew: after a change of the drawing, the camera or the selection. */
    build(sheet, { selection = [], names = true, grid = true, faulty = [] } = {}) {
      const px = at => this.px(at), chosen = new Set(selection), ids = Object.keys(sheet.links);
      this.carrier = new Map(Object.keys(sheet.points).map(id => [id, Bench.linksAt(sheet, id)[0]]));
      this.layers.grid.replaceChildren(...(grid ? this.grid() : []));
      this.groups = ids.map((id, k) => {
        const marks = [`link k${k % 6}`, ...(id === Bench.GROUND ? ["frame"] : []), ...(chosen.has(id) ? ["chosen"] : []),
          ...(faulty.includes(id) ? ["faulty"] : [])];
        return [id, svg("g", { class: marks.join(" "), "data-id": id }, ...Bench.linkSymbols(sheet, id, px))];
      });
      this.layers.links.replaceChildren(...this.groups.map(([, group]) => group));
      this.spots = Object.keys(sheet.points).map(id => {
        const group = svg("g", { class: `point${chosen.has(id) ? " chosen" : ""}`, "data-id": id });
        group.append(...Bench.pointSymbol(sheet, id));
        if (names) group.append(svg("text", { class: "letter", x: 9, y: -9 }, sheet.points[id].name));
        return [id, group];
      });
      this.layers.points.replaceChildren(...this.spots.map(([, group]) => group));
      this.drives = [];
      for (const driver of sheet.drivers) {
        const joint = Bench.drivable(sheet, driver.base, driver.link);
        if (!joint) continue;
        const turn = joint.turns ? 0 : (-Bench.direction(sheet, sheet.pairs[joint.pair]) * 180) / Math.PI;
        this.drives.push([joint.at, svg("g", { class: "driver" }, ...Bench.driverSymbol(joint.turns, turn))]);
      }
      const pairMarks = Object.keys(sheet.pairs).filter(id => chosen.has(id)).map(id => {
        const at = sheet.pairs[id].at;
        return [at, svg("g", {}, svg("circle", { class: "ring", r: 20 }))];
      });
      this.drives.push(...pairMarks);
      this.layers.marks.replaceChildren(...this.drives.map(([, group]) => group));
      this.show(sheet);
    }

    /** Show the pose: groups are shifted and turned as a whole, those that moved. */
    show(sheet) {
      const [ox, oy] = this.px([0, 0]), { scale } = this.camera;
      const put = (group, to) => { if (this.shown.get(group) !== to) { this.shown.set(group, to); group.setAttribute("transform", to); } };
      for (const [id, group] of this.groups) {
        const [x, y, turn] = this.row(sheet, id);
        const to = `translate(${(ox + x * scale).toFixed(2)} ${(oy - y * scale).toFixed(2)})`;
        put(group, !x && !y && !turn ? "" : `${to} rotate(${((-turn * 180) / Math.PI).toFixed(4)}) translate(${-ox} ${-oy})`);
      }
      for (const [id, group] of [...this.spots, ...this.drives]) {
        const [x, y] = this.where(sheet, id);
        put(group, `translate(${x.toFixed(2)} ${y.toFixed(2)})`);
      }
    }

    /** Lines of the grid, the axes stronger. */
    grid() {
      const step = Bench.gridStep(this.camera.scale, 14), low = this.place([0, this.height]), high = this.place([this.width, 0]);
      const lines = { fine: [], bold: [], axis: [] };
      const kind = k => (k === 0 ? "axis" : k % 5 === 0 ? "bold" : "fine");
      for (let k = Math.ceil(low.x / step); k * step <= high.x; k++) {
        const [x] = this.px([k * step, 0]);
        lines[kind(k)].push(`M${x.toFixed(1)} 0V${this.height}`);
      }
      for (let k = Math.ceil(low.y / step); k * step <= high.y; k++) {
        const [, y] = this.px([0, k * step]);
        lines[kind(k)].push(`M0 ${y.toFixed(1)}H${this.width}`);
      }
      return Object.entries(lines).map(([name, parts]) => svg("path", { class: `grid ${name}`, d: parts.join("") }));
    }
  };
})();
