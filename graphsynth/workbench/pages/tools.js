// The tools: how many places each picks, and what it then does to the drawing.  A pick is
// {x, y, point, link, pair}: where, and what lies there.  Pure functions, so that tests need no browser.
"use strict";

(function () {
  const angleOf = (from, to) => {
    if (from.x === to.x && from.y === to.y) throw new Bench.Fault("fault.short");
    return Math.atan2(to.y - from.y, to.x - from.x);
  };
  const needPoint = pick => {
    if (!pick.point) throw new Bench.Fault("fault.nothing");
    return pick.point;
  };

  function slider(sheet, [from, to]) {
    const guide = to.link && to.link !== Bench.GROUND &&
      !Bench.linksAt(sheet, needPoint(from)).includes(to.link) ? to.link : Bench.GROUND;
    const [next, id] = Bench.addSlider(sheet, needPoint(from), angleOf(from, to), guide);
    return { sheet: next, select: [id], say: ["said.slider", { a: Bench.linkName(next, guide) }] };
  }

  function slot(sheet, [from, to]) {
    const point = needPoint(from), slotted = to.link;
    if (!slotted || Bench.linksAt(sheet, point).includes(slotted)) throw new Bench.Fault("fault.slot");
    const ends = sheet.links[slotted].points, along = ends.length === 2 ? ends : undefined;
    const [next, id] = Bench.addSlot(sheet, point, slotted, angleOf(from, to), along);
    return { sheet: next, select: [id], say: ["said.slot", { a: Bench.linkName(next, slotted) }] };
  }

  function gears(sheet, picks) {
    let ids;
    [sheet, ids] = Bench.picked(sheet, picks);
    for (const id of ids) if (Bench.linksAt(sheet, id).length === 0) sheet = Bench.toggleGround(sheet, id);
    const [next, pair] = Bench.addGears(sheet, ...ids);
    return { sheet: next, select: [pair], say: ["said.gears"] };
  }

  function cam(sheet, picks) {
    let ids;
    [sheet, ids] = Bench.picked(sheet, picks);
    if (Bench.linksAt(sheet, ids[0]).length === 0) sheet = Bench.toggleGround(sheet, ids[0]);
    const [next, pair] = Bench.addCam(sheet, ...ids);
    return { sheet: next, select: [pair], say: ["said.cam"] };
  }

  function bar(sheet, picks) {
    const [next, id] = Bench.drawLink(sheet, picks);
    return { sheet: next, select: [id], say: ["said.link", { a: Bench.linkName(next, id) }] };
  }

  function ground(sheet, [pick]) {
    let point = pick.point;
    if (!point) [sheet, [point]] = Bench.picked(sheet, [{ ...pick, link: null }]);
    const next = Bench.toggleGround(sheet, point), fixed = next.links[Bench.GROUND].points.includes(point);
    return { sheet: next, select: [point], say: [fixed ? "said.fixed" : "said.freed", { p: next.points[point].name }] };
  }

  function driver(sheet, [pick]) {
    const pair = pick.pair && sheet.pairs[pick.pair].kind === "P" ? sheet.pairs[pick.pair] : null;
    const links = pair ? [pair.a, pair.b] : Bench.driverAt(sheet, needPoint(pick));
    if (!links) throw new Bench.Fault("fault.driver");
    const next = Bench.toggleDriver(sheet, ...links), on = next.drivers.length > sheet.drivers.length;
    const names = { a: Bench.linkName(next, links[1]), b: Bench.linkName(next, links[0]) };
    return { sheet: next, select: pick.point ? [pick.point] : [], say: [on ? "said.driven" : "said.undriven", names] };
  }

  function trace(sheet, [pick]) {
    let point = pick.point;
    if (!point && !pick.link) throw new Bench.Fault("fault.body");
    const fresh = !point;
    if (fresh) [sheet, [point]] = Bench.picked(sheet, [pick]);
    const on = fresh || !sheet.points[point].trace;
    const points = { ...sheet.points, [point]: { ...sheet.points[point], trace: on } };
    const say = [on ? "said.traced" : "said.untraced", { p: points[point].name }];
    return { sheet: { ...sheet, points }, select: [point], say };
  }

  /** Name, key, number of places (0: moves what is there; Infinity: until it is ended), and what is done. */
  Bench.TOOLS = {
    select: { key: "v", picks: 0 },
    link: { key: "l", picks: 2, apply: bar },
    plate: { key: "p", picks: Infinity, apply: bar },
    ground: { key: "g", picks: 1, apply: ground },
    slider: { key: "s", picks: 2, apply: slider },
    slot: { key: "t", picks: 2, apply: slot },
    gears: { key: "e", picks: 2, apply: gears },
    cam: { key: "c", picks: 2, apply: cam },
    driver: { key: "d", picks: 1, apply: driver },
    trace: { key: "k", picks: 1, apply: trace },
    measure: { key: "m", picks: 2 },
    picture: { key: "i", picks: 2 },
    target: { key: "w", picks: 0 },
    poses: { key: "q", picks: 0 },
  };

  /** Where a place snaps to: {x, y, kind}.  Points first, then the angle from where a line begins, then the grid. */
  Bench.snapped = (place, { point, from, straight, grid, off }) => {
    if (off) return { ...place, kind: "" };
    if (point) return { x: point.x, y: point.y, kind: "point" };
    if (from && straight) {
      const length = Math.hypot(place.x - from.x, place.y - from.y), step = Math.PI / 12;
      const turn = Math.round(Math.atan2(place.y - from.y, place.x - from.x) / step) * step;
      const round = grid ? Math.round(length / grid) * grid : length;
      return { x: from.x + round * Math.cos(turn), y: from.y + round * Math.sin(turn), kind: "angle" };
    }
    if (grid) {
      const tidy = value => Number((Math.round(value / grid) * grid).toPrecision(12));
      return { x: tidy(place.x), y: tidy(place.y), kind: "grid" };
    }
    return { ...place, kind: "" };
  };

  /** The step of the grid: 1, 2 or 5 times a power of ten, at least so many pixels wide. */
  Bench.gridStep = (scale, pixels = 14) => {
    const least = pixels / scale, power = 10 ** Math.floor(Math.log10(least));
    return [1, 2, 5, 10].map(k => k * power).find(step => step >= least * 0.999999);
  };

  /** A length as a person writes it ("12", "1.5 in", "3,2 cm"), in the unit of the drawing; NaN for anything else. */
  Bench.parseLength = (text, unit) => {
    const found = /^\s*([+−-]?\d*[.,]?\d*(?:e[+-]?\d+)?)\s*(mm|cm|m|in|мм|см|м|дюйм)?\s*$/i.exec(text);
    if (!found || !/\d/.test(found[1])) return NaN;
    const names = { мм: "mm", см: "cm", м: "m", дюйм: "in" }, size = Bench.UNIT_SIZE;
    const own = (found[2] || unit).toLowerCase(), value = Number(found[1].replace(",", ".").replace("−", "-"));
    return own === unit ? value : (value * size[names[own] || own]) / size[unit];
  };
})();
