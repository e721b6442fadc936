// DXF (R12) of the drawing: every link on a layer of its own, joints as circles, traced paths as polylines.
"use strict";

(function () {
  const pairs = (...all) => all.map(([code, value]) => `${code}\n${value}`).join("\n");
  const coordinate = value => Number(value.toPrecision(12)).toString();
  const at = ([x, y]) => [[10, coordinate(x)], [20, coordinate(y)], [30, "0"]];

  function polyline(layer, points, closed) {
    return [
      pairs([0, "POLYLINE"], [8, layer], [66, 1], ...at([0, 0]), [70, closed ? 1 : 0]),
      ...points.map(point => pairs([0, "VERTEX"], [8, layer], ...at(point))),
      pairs([0, "SEQEND"], [8, layer]),
    ];
  }

  /** DXF of a sheet; `paths` are lists of places with a name. */
  Bench.toDxf = (sheet, paths = []) => {
    const body = [], box = Bench.box(sheet) || [0, 0, 1, 1], size = Math.max(box[2] - box[0], box[3] - box[1]) || 1;
    const place = id => [sheet.points[id].x, sheet.points[id].y];
    Object.keys(sheet.links).forEach((id, k) => {
      const corners = Bench.hull(Bench.shapeOf(sheet, id));
      if (id !== Bench.GROUND && corners.length > 1) body.push(...polyline(`LINK_${k}`, corners, corners.length > 2));
      for (const point of sheet.links[id].points) {
        body.push(pairs([0, "CIRCLE"], [8, id === Bench.GROUND ? "FRAME" : `LINK_${k}`], ...at(place(point)), [40, coordinate(size * (id === Bench.GROUND ? 0.012 : 0.008))]));
      }
    });
    for (const pair of Object.values(sheet.pairs)) {
      if (pair.kind === "gear") {
        [pair.at, pair.on].forEach((id, k) => body.push(pairs([0, "CIRCLE"], [8, "GEARS"], ...at(place(id)), [40, coordinate(pair.radii[k])])));
      } else if (pair.kind !== "cam") {
        const [x, y] = place(pair.at), turn = Bench.direction(sheet, pair), reach = size * 0.15;
        const ends = [-1, 1].map(s => [x + s * reach * Math.cos(turn), y + s * reach * Math.sin(turn)]);
        body.push(...polyline("GUIDES", ends, false));
      }
    }
    for (const { points, closed } of paths) body.push(...polyline("PATHS", points, closed));
    return `${[pairs([0, "SECTION"], [2, "HEADER"], [9, "$ACADVER"], [1, "AC1009"], [0, "ENDSEC"], [0, "SECTION"], [2, "ENTITIES"]),
      ...body, pairs([0, "ENDSEC"], [0, "EOF"])].join("\n")}\n`;
  };
})();
