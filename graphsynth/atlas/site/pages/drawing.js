// Pictures: the kinematic diagram of a chain from the places of its joints, and its graph by adjacency levels.
"use strict";

(function () {
  const COLOURS = {
    ink: ["#1b2733", "#e6edf3"], paper: ["#ffffff", "#14181b"], soft: ["#8794a1", "#8b98a5"], fill: ["#e3e6e1", "#2c3437"],
    g1: ["#0072b2", "#56b4e9"], g2: ["#a34700", "#f0a060"], g3: ["#007a59", "#3ecf9f"], g4: ["#aa4499", "#dd88cc"],
    drive: ["#b3261e", "#ff8a7a"],
  };
  // for files: plain colours, which every program reads, and rules for dark pages on top; on the page the style sheet
  // gives the names
  const DARK = Object.values(COLOURS).flatMap(([light, dark]) => ["fill", "stroke"].map(what => `[${what}="${light}"]{${what}:${dark}}`));
  const STYLE = `<style>@media (prefers-color-scheme:light){svg:root{background:#ffffff}}@media (prefers-color-scheme:dark){svg:root{color-scheme:dark;background:#14181b}${DARK.join("")}}</style>`;
  const plain = body => body.replace(/var\(--(\w+)\)/g, (_, name) => COLOURS[name][0]);
  const short = value => String(Math.round(value * 10) / 10);
  let pictures = 0;

  /** The places of joints, in units of the drawing, from two base64url digits for each coordinate. */
  Atlas.places = function (text) {
    const bytes = [...text].map(c => Atlas.DIGITS.indexOf(c));
    const found = [];
    for (let k = 0; k < bytes.length; k += 4) found.push([bytes[k] << 6 | bytes[k + 1], bytes[k + 2] << 6 | bytes[k + 3]]);
    return found;
  };

  /** The joints of each link in the order of its outline. */
  Atlas.outlines = function (graph, places) {
    return Array.from({length: graph.links}, (_, link) => {
      const own = graph.joints.map((joint, k) => k).filter(k => graph.joints[k][0] === link || graph.joints[k][1] === link);
      const cx = own.reduce((sum, k) => sum + places[k][0], 0) / own.length, cy = own.reduce((sum, k) => sum + places[k][1], 0) / own.length;
      const turn = k => Math.atan2(places[k][1] - cy, places[k][0] - cx);
      return own.sort((p, q) => turn(p) - turn(q));
    });
  };

  function fit(places, width, height, margin) {
    const xs = places.map(p => p[0]), ys = places.map(p => p[1]);
    const left = Math.min(...xs), top = Math.max(...ys), wide = Math.max(...xs) - left || 1, tall = top - Math.min(...ys) || 1;
    const scale = Math.min((width - 2 * margin) / wide, (height - 2 * margin) / tall);
    const x0 = (width - scale * wide) / 2, y0 = (height - scale * tall) / 2;
    return places.map(([x, y]) => [x0 + scale * (x - left), y0 + scale * (top - y)]);
  }

  /** Strokes of the ground along a line, on the side away from `from`. */
  function ground([x, y], [u, v], from, step) {
    const long = Math.hypot(u - x, v - y) || 1, dx = (u - x) / long, dy = (v - y) / long;
    const side = (from[0] - x) * -dy + (from[1] - y) * dx > 0 ? -1 : 1;
    let path = "";
    for (let t = step / 2; t < long; t += step)
      path += `M${short(x + t * dx)} ${short(y + t * dy)}l${short((-dy * side - dx) * step * .8)} ${short((dx * side - dy) * step * .8)}`;
    return path;
  }

  /** Name of the colour of a link: the driver's, that of its group, or ink. */
  const colours = (drivers, groups) => link => {
    const k = groups.findIndex(group => group.links.includes(link));
    return drivers.includes(link) ? "drive" : k < 0 ? "ink" : `g${k % 4 + 1}`;
  };

  /**
   * The kinematic diagram as SVG text.  Options: width, height, frame, drivers, groups (as from Atlas.groups), numbers,
   * title, file (colours inside, for a file of its own), small, sliders (places of prismatic joints, for
   * which Atlas.loadSliders is waited for).
   */
  Atlas.sketch = function (graph, places, options = {}) {
    const {width = 420, height = 340, frame = null, drivers = [], groups = [], numbers = true, small = false, title = "", sliders = []} = options;
    const at = fit(places, width, height, small ? 7 : 26), outlines = Atlas.outlines(graph, places);
    const middle = [at.reduce((s, p) => s + p[0], 0) / at.length, at.reduce((s, p) => s + p[1], 0) / at.length];
    const wide = small ? 1.6 : 3.2, radius = small ? 2 : 5, hatch = `hatch${++pictures}`;
    const colour = colours(drivers, groups);
    const plates = [], bars = [], letters = [];
    outlines.forEach((own, link) => {
      const points = own.map(k => at[k]), data = "M" + points.map(p => p.map(short).join(" ")).join("L");
      const fixed = link === frame, stroke = `stroke="var(--${fixed ? "soft" : colour(link)})" stroke-width="${wide}"`;
      let cx = points.reduce((s, p) => s + p[0], 0) / points.length, cy = points.reduce((s, p) => s + p[1], 0) / points.length;
      if (own.length > 2) {
        const fill = fixed ? `url(#${hatch})` : `var(--${colour(link) === "ink" ? "fill" : colour(link)})`;
        plates.push(`<path data-link="${link}" d="${data}Z" fill="${fill}" fill-opacity="${fixed || colour(link) === "ink" ? 1 : .25}" ${stroke} stroke-linejoin="round"/>`);
      } else {
        bars.push(`<path data-link="${link}" d="${data}" fill="none" ${stroke} stroke-linecap="round"/>`);
        if (fixed) bars.push(`<path d="${ground(points[0], points[1], middle, small ? 4 : 9)}" fill="none" stroke="var(--soft)" stroke-width="${small ? .8 : 1.4}"/>`);
        // beside the bar, on the outer side
        const dx = points[1][0] - points[0][0], dy = points[1][1] - points[0][1], long = Math.hypot(dx, dy) || 1;
        const out = (cx - middle[0]) * -dy + (cy - middle[1]) * dx < 0 ? -1 : 1;
        cx += out * -dy / long * (fixed ? 17 : 11);
        cy += out * dx / long * (fixed ? 17 : 11);
      }
      // the halo is a text of its own: not every program paints an edge before the letters
      if (numbers && !small) letters.push(...['stroke="var(--paper)" stroke-width="3.5" stroke-linejoin="round" aria-hidden="true"', ""].map(edge =>
        letter(cx, cy, link, 13, `text-anchor="middle" fill="var(--${fixed ? "ink" : colour(link)})" ${edge}`)));
    });
    const driven = ([a, b]) => !small && ((a === frame && drivers.includes(b)) || (b === frame && drivers.includes(a)));
    const joints = graph.joints.map(([a, b], k) => sliders.includes(k) ? Atlas.block(graph, at, k, outlines, driven(graph.joints[k]), small) :
      `<circle data-joint="${a}-${b}" cx="${short(at[k][0])}" cy="${short(at[k][1])}" r="${radius}" fill="var(--paper)" stroke="var(--ink)" stroke-width="${small ? 1.1 : 1.8}"/>`);
    const arrows = graph.joints.flatMap((joint, k) => (driven(joint) && !sliders.includes(k) ? [arrow(at[k])] : []));
    const pattern = frame !== null && outlines[frame].length > 2
      ? `<defs><pattern id="${hatch}" width="6" height="6" patternUnits="userSpaceOnUse" patternTransform="rotate(45)"><path d="M0 0V6" fill="none" stroke="var(--soft)" stroke-width="1.6"/></pattern></defs>` : "";
    return wrap(width, height, title, options.file, pattern + [...plates, ...bars, ...joints, ...arrows, ...letters].join(""));
  };

  /** Text whose capitals and digits have their middle at a point. */
  const letter = (x, y, text, size, more) => `<text x="${short(x)}" y="${short(y + .36 * size)}" font-size="${size}" ${more}>${text}</text>`;

  function arrow([x, y]) {
    const r = 14, a = -2.4, b = .5, tip = [x + r * Math.cos(b), y + r * Math.sin(b)];
    return `<path d="M${short(x + r * Math.cos(a))} ${short(y + r * Math.sin(a))}A${r} ${r} 0 0 1 ${tip.map(short).join(" ")}" fill="none" stroke="var(--drive)" stroke-width="2"/>` +
      `<path d="M${short(tip[0] + 1)} ${short(tip[1] + 5)}l-5.4 -6l8.6 -2.4z" fill="var(--drive)"/>`;
  }

  function wrap(width, height, title, file, body) {
    const name = Atlas.plain(title);
    const about = title ? ` role="img" aria-label="${name}"` : ' aria-hidden="true"';
    return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${short(width)} ${short(height)}" width="${short(width)}" height="${short(height)}"${about}` +
      `${file ? ' font-family="system-ui,sans-serif"' : ""}>${title ? `<title>${name}</title>` : ""}${file ? STYLE + plain(body) : body}</svg>`;
  }

  /** Levels with their links sorted so that joints cross little (barycentres, Sugiyama, Tagawa and Toda 1981). */
  function sortedLevels(graph) {
    const levels = Atlas.levels(graph), near = Atlas.neighbours(graph), place = new Map();
    const spread = level => level.forEach((link, k) => place.set(link, k - (level.length - 1) / 2));
    const crossings = () => {
      let sum = 0;
      graph.joints.forEach(([a, b], i) => graph.joints.slice(i + 1).forEach(([c, d]) => {
        const pair = [[a, b], [c, d]].map(([p, q]) => (depth.get(p) < depth.get(q) ? [p, q] : [q, p]));
        const [[p, q], [r, s]] = pair;
        if (depth.get(p) !== depth.get(q) && depth.get(p) === depth.get(r) && depth.get(q) === depth.get(s) &&
            (place.get(p) - place.get(r)) * (place.get(q) - place.get(s)) < 0) sum += 1;
      }));
      return sum + graph.joints.reduce((own, [a, b]) =>
        own + (depth.get(a) === depth.get(b) ? .5 * (Math.abs(place.get(a) - place.get(b)) - 1) : 0), 0);
    };
    const depth = new Map(levels.flatMap((level, k) => level.map(link => [link, k])));
    levels.forEach(spread);
    let best = levels.map(level => level.slice()), fewest = crossings();
    for (let sweep = 0; sweep < 8; sweep++) {
      for (const level of sweep % 2 ? levels.slice().reverse() : levels.slice(1)) {
        const mean = new Map(level.map(v => [v, near[v].reduce((sum, u) => sum + place.get(u), 0) / near[v].length]));
        level.sort((p, q) => mean.get(p) - mean.get(q) || p - q);
        spread(level);
      }
      const own = crossings();
      if (own < fewest) { fewest = own; best = levels.map(level => level.slice()); }
    }
    return best;
  }

  /** The graph by adjacency levels, the frame on top. */
  Atlas.levelSketch = function (graph, options = {}) {
    const {width = 360, drivers = [], groups = [], title = ""} = options, levels = sortedLevels(graph), radius = 11;
    const row = 62, height = row * (levels.length - 1) + 4 * radius + 34, where = new Map();
    const step = Math.min(56, (width - 60) / Math.max(1, Math.max(...levels.map(level => level.length)) - 1));
    levels.forEach((level, k) => level.forEach((link, i) => {
      where.set(link, [width / 2 + (i - (level.length - 1) / 2) * step * (level.length < 3 ? 1.25 : 1), 2 * radius + 8 + row * k]);
    }));
    const colour = colours(drivers, groups);
    const edges = graph.joints.map(([a, b]) => {
      const [x, y] = where.get(a), [u, v] = where.get(b), bend = y === v ? 18 + .16 * Math.abs(u - x) : 0;
      return `<path d="M${short(x)} ${short(y)}Q${short((x + u) / 2)} ${short((y + v) / 2 + bend)} ${short(u)} ${short(v)}" fill="none" stroke="var(--ink)" stroke-width="1.5"/>`;
    });
    const nodes = [...where].map(([link, [x, y]]) => {
      const fixed = link === graph.frame;
      return `<g data-link="${link}"><circle cx="${short(x)}" cy="${short(y)}" r="${radius}" fill="var(--${fixed ? "ink" : "paper"})" stroke="var(--${fixed ? "ink" : colour(link)})" stroke-width="2"/>` +
        `${letter(x, y, link, 12, `text-anchor="middle" fill="var(--${fixed ? "paper" : colour(link)})"`)}</g>`;
    });
    const [fx, fy] = where.get(graph.frame), base = [[fx + 16, fy - radius - 4], [fx - 16, fy - radius - 4]];
    const earth = `<path d="M${short(base[0][0])} ${short(base[0][1])}L${short(base[1][0])} ${short(base[1][1])}${ground(base[1], base[0], [fx, fy], 8)}" fill="none" stroke="var(--ink)" stroke-width="1.4"/>`;
    const rows = levels.map((level, k) => letter(4, 2 * radius + 8 + row * k, k, 11, 'fill="var(--soft)"'));
    return wrap(width, height, title, options.file, rows.join("") + edges.join("") + earth + nodes.join(""));
  };
})();
