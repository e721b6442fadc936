// Structural (Assur) groups of a mechanism driven at joints of its frame: graphsynth/structure/assur.py in the browser.
"use strict";

(function () {
  /** Give every body its `space` constraints by augmenting paths; null if there are too many or too few. */
  function assign(bodies, placed, constraints, space) {
    const owned = new Map(bodies.map(body => [body, []]));
    const owner = [];
    const put = (edge, body) => { owner[edge] = body; owned.get(body).push(edge); };
    function take(edge, seen) {
      for (const body of constraints[edge]) {
        if (body === placed || seen.has(body)) continue;
        seen.add(body);
        const held = owned.get(body);
        if (held.length < space) { put(edge, body); return true; }
        for (const other of held.slice())
          if (take(other, seen)) { held.splice(held.indexOf(other), 1); put(edge, body); return true; }
      }
      return false;
    }
    for (let edge = 0; edge < constraints.length; edge++)
      if (constraints[edge][0] === constraints[edge][1] || !take(edge, new Set())) return null;
    return bodies.every(body => owned.get(body).length === space) ? owned : null;
  }

  function reaching(body, near) {
    const seen = new Set([body]), waiting = [body];
    while (waiting.length)
      for (const other of near.get(waiting.pop()) || []) if (!seen.has(other)) { seen.add(other); waiting.push(other); }
    return seen;
  }

  /**
   * Groups in the order of assembly, each {links, order, stage, key}; null where these drivers do not move the
   * mechanism.  `drivers` are links jointed to the frame by joints of mobility 1; `key` is that of the group with what
   * it hangs on as frame.
   */
  Atlas.groups = function (graph, drivers) {
    const frame = graph.frame, body = link => (drivers.includes(link) ? frame : link);
    if (Atlas.mobility(graph) !== drivers.length) return null;
    const joints = graph.joints.filter(([a, b]) => !((a === frame && drivers.includes(b)) || (b === frame && drivers.includes(a))));
    const constraints = [];
    for (const [a, b, m] of joints) for (let k = m; k < graph.space; k++) constraints.push([body(a), body(b)]);
    const bodies = [...Array(graph.links).keys()].filter(link => body(link) !== frame);
    const owned = assign(bodies, frame, constraints, graph.space);
    if (!owned) return null;
    const near = new Map(bodies.map(own => [own, owned.get(own).map(e => constraints[e][0] === own ? constraints[e][1] : constraints[e][0])]));
    const reach = new Map(bodies.map(own => [own, reaching(own, near)]));
    let left = [];
    for (const own of bodies) {
      if (left.some(group => group.links.includes(own))) continue;
      const links = bodies.filter(other => reach.get(own).has(other) && reach.get(other).has(own));
      left.push({links, needs: [...reach.get(own)].filter(other => !links.includes(other))});
    }
    const stage = new Map([[frame, 0]]), ordered = [];
    while (left.length) {
      const group = left.find(one => one.needs.every(other => stage.has(other)));
      left = left.filter(one => one !== group);
      ordered.push(describe(graph, joints, body, group.links, stage));
    }
    return ordered;
  };

  function describe(graph, joints, body, links, stage) {
    const place = new Map(links.map((link, k) => [link, k + 1])), own = [];
    let order = 0, latest = 0;
    for (const [a, b, m] of joints) {
      const p = place.get(body(a)), q = place.get(body(b));
      if (p && q) own.push([p, q, m]);
      else if (p || q) {
        const far = stage.get(p ? body(b) : body(a));
        if (far === undefined) continue;
        own.push([0, p || q, m]);
        order++;
        latest = Math.max(latest, far);
      }
    }
    for (const link of links) stage.set(link, latest + 1);
    return {links, order, stage: latest + 1, key: keyOf(links.length + 1, own, graph.space)};
  }

  // two joints of one link with the base (possible beside gears and cams) have no place in a simple graph
  function keyOf(links, joints, space) {
    const pairs = new Set(joints.map(([a, b]) => Math.min(a, b) * links + Math.max(a, b)));
    return pairs.size === joints.length ? Atlas.label(Atlas.graph(links, joints, 0, space)).key : null;
  }
})();
