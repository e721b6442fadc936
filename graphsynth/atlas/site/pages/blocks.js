// The symbol of a prismatic joint in a sketch.
"use strict";

(function () {
  const short = value => String(Math.round(value * 10) / 10);

  /**
   * A block on a guide in a sketch, across the line to the other joints of its link with fewer; with an arrow if it is driven.
   */
  Atlas.block = function (graph, at, k, outlines, driven, small) {
    const [a, b] = graph.joints[k], r = small ? 2 : 5, others = outlines[outlines[a].length > outlines[b].length ? b : a].filter(other => other !== k);
    const [dx, dy] = [0, 1].map(c => others.reduce((sum, other) => sum + at[other][c] - at[k][c], 0));
    const arrow = driven ? '<path d="M-14 13H10" stroke="var(--drive)" stroke-width="2"/><path d="M17 13l-8 -4.5v9z" fill="var(--drive)" stroke="none"/>' : "";
    const guide = [-1, 1].map(side => `M${-3.2 * r} ${side * r}h${6.4 * r}`).join("");
    return `<g data-joint="${a}-${b}" data-slider="" transform="translate(${at[k].map(short).join(" ")}) rotate(${short(Math.atan2(dy, dx) * 180 / Math.PI + 90)})" stroke="var(--ink)" stroke-width="${small ? 1.1 : 1.8}">` +
      `<path d="${guide}" fill="none"/><rect x="${-1.6 * r}" y="${-r}" width="${3.2 * r}" height="${2 * r}" fill="var(--paper)"/>${arrow}</g>`;
  };
})();
