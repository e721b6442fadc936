// What lies under a place, in pixels: the nearest point, then a pair, then a link.
"use strict";

(function () {
  function toSegment([x, y], [ax, ay], [bx, by]) {
    const dx = bx - ax, dy = by - ay, length = dx * dx + dy * dy;
    const t = length ? Math.max(0, Math.min(1, ((x - ax) * dx + (y - ay) * dy) / length)) : 0;
    return Math.hypot(x - ax - t * dx, y - ay - t * dy);
  }

  function inside([x, y], corners) {
    let odd = false;
    corners.forEach(([ax, ay], k) => {
      const [bx, by] = corners[(k + 1) % corners.length];
      if ((ay > y) !== (by > y) && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) odd = !odd;
    });
    return odd;
  }

  /** Distance of a place from a polygon or a bar; 0 inside. */
  Bench.farFrom = (place, corners) => {
    if (corners.length === 1) return Math.hypot(place[0] - corners[0][0], place[1] - corners[0][1]);
    if (corners.length > 2 && inside(place, corners)) return 0;
    return Math.min(...corners.map((corner, k) => toSegment(place, corner, corners[(k + 1) % corners.length])));
  };

  /** {point, pair, link} at a place in pixels; `where(point)` and `shape(link)` say where things are now. */
  Bench.hit = (sheet, place, where, shape, reach = 13, skip = []) => {
    const found = { point: null, pair: null, link: null };
    let least = reach;
    for (const id of Object.keys(sheet.points)) {
      const [x, y] = where(id), far = Math.hypot(x - place[0], y - place[1]);
      if (far < least && !skip.includes(id)) { least = far; found.point = id; }
    }
    least = reach + 3;
    for (const [id, pair] of Object.entries(sheet.pairs)) {
      const ends = [where(pair.at), where(pair.on || pair.at)];
      const far = Bench.farFrom(place, ends);
      if (far < least) { least = far; found.pair = id; }
    }
    least = reach - 3;
    for (const id of Object.keys(sheet.links)) {
      if (id === Bench.GROUND) continue;
      const corners = shape(id);
      if (!corners.length) continue;
      const far = Bench.farFrom(place, corners);
      if (far <= least) { least = far; found.link = id; }
    }
    return found;
  };
})();
