// The canonical form of a mechanism graph: the search of graphsynth/structure/search.py, step for step, so that the
// browser gives the same keys.  McKay (1981): ordered partitions, refinement, pruning by automorphisms.
"use strict";

(function () {
  const MIX = 0x9E3779B97F4A7C15n, LEAF = 1n << 63n;
  const word = value => BigInt.asUintN(64, value);
  const mix = (state, value) => { const next = word((state ^ value) * MIX); return next ^ next >> 32n; };
  // nodes of a search, and milliseconds: a sentence rather than a page that hangs
  const MOST_NODES = 20000, MOST_TIME = 4000;

  function find(parent, vertex) {
    while (parent[vertex] !== vertex) { parent[vertex] = parent[parent[vertex]]; vertex = parent[vertex]; }
    return vertex;
  }
  function merge(parent, permutation) {
    let joined = false;
    permutation.forEach((image, vertex) => {
      const a = find(parent, vertex), b = find(parent, image);
      if (a !== b) { parent[Math.max(a, b)] = Math.min(a, b); joined = true; }
    });
    return joined;
  }
  const numbers = n => Array.from({length: n}, (_, i) => i);

  class Search {
    // layers[c][v]: the vertices joined to v by an edge of colour c
    constructor(n, layers, colours) {
      Object.assign(this, {n, layers, colours});
      this.generators = []; this.others = []; this.index = []; this.orbits = numbers(n);
      let weight = 1n;
      this.weights = layers.map(() => { const own = weight; weight = word(weight * MIX); return own; });
      const entry = value => new Array(n + 1).fill(value);
      this.lab = entry(null); this.starts = entry(null); this.cell = entry(0); this.left = entry(null);
      this.path = entry(-1); this.trace = entry(0n); this.likeFirst = entry(true); this.versusBest = entry(0);
      this.haveLeaf = false; this.onFirst = -1; this.nodes = 0; this.begun = performance.now();
      this.firstTrace = []; this.bestTrace = []; this.bestPath = [];
    }

    run() {
      this.root();
      let level = 0;
      for (;;) {
        level = this.visit(level);
        let vertex = -1;
        while (level >= 0) {
          vertex = this.next(level);
          if (vertex >= 0) break;
          if (level === this.onFirst) {
            const root = find(this.orbits, this.firstPath[level]);
            this.index.push(numbers(this.n).filter(v => find(this.orbits, v) === root).length);
            this.onFirst--;
          }
          level--;
        }
        if (level < 0) break;
        this.child(level, vertex);
        level++;
      }
      this.orbits = numbers(this.n).map(v => find(this.orbits, v));
      return this;
    }

    root() {
      this.lab[0] = numbers(this.n).sort((x, y) => this.colours[x] - this.colours[y]);
      const starts = new Uint8Array(this.n);
      this.lab[0].forEach((vertex, place) => {
        if (place === 0 || this.colours[vertex] !== this.colours[this.lab[0][place - 1]]) starts[place] = 1;
      });
      this.refine(0, starts, starts.slice());
    }

    child(level, vertex) {
      if (++this.nodes > MOST_NODES || performance.now() - this.begun > MOST_TIME)
        throw new Atlas.Fault("This graph is too symmetric to be named in the browser; ask graphsynth show for its key.");
      const lab = this.lab[level].slice(), place = this.cell[level], where = lab.indexOf(vertex, place);
      [lab[place], lab[where]] = [lab[where], lab[place]];
      this.path[level] = vertex;
      this.lab[level + 1] = lab;
      const starts = this.starts[level].slice(), active = new Uint8Array(this.n);
      starts[place + 1] = 1;
      active[place] = 1;
      this.refine(level + 1, starts, active);
    }

    end(starts, place) {
      do place++; while (place < this.n && !starts[place]);
      return place;
    }

    // split cells by the number of edges of each colour into active cells, until nothing splits
    refine(level, starts, active) {
      const lab = this.lab[level];
      this.state = 0n;
      const cells = () => starts.reduce((sum, one) => sum + one, 0);
      for (let place; cells() < this.n && (place = active.indexOf(1)) >= 0;) {
        active[place] = 0;
        const end = this.end(starts, place), splitter = new Uint8Array(this.n);
        for (let k = place; k < end; k++) splitter[lab[k]] = 1;
        this.state = mix(this.state, BigInt(place) << 8n | BigInt(end - place));
        for (let low = 0; low < this.n;) {
          const high = this.end(starts, low);
          if (high - low > 1) this.split(lab, low, high, splitter, starts, active);
          low = high;
        }
      }
      this.starts[level] = starts;
      this.trace[level] = this.state >> 1n | (cells() === this.n ? LEAF : 0n);
    }

    split(lab, low, high, splitter, starts, active) {
      const keys = new Map();
      for (let k = low; k < high; k++) {
        let key = 0n;
        this.layers.forEach((layer, c) => {
          let count = 0;
          for (const other of layer[lab[k]]) count += splitter[other];
          key += this.weights[c] * BigInt(count);
        });
        keys.set(lab[k], word(key));
      }
      const first = keys.get(lab[low]);
      if ([...keys.values()].every(key => key === first)) {
        this.state = mix(mix(this.state, BigInt(low)), first);
        return;
      }
      const cell = lab.slice(low, high).sort((x, y) => (keys.get(x) < keys.get(y) ? -1 : keys.get(x) > keys.get(y) ? 1 : 0));
      cell.forEach((vertex, k) => { lab[low + k] = vertex; });
      const wasActive = active[low];
      let largest = low, size = 0, begin = low;
      for (let place = low + 1; place <= high; place++)
        if (place === high || keys.get(lab[place]) !== keys.get(lab[begin])) {
          starts[begin] = 1;
          active[begin] = 1;
          this.state = mix(mix(this.state, BigInt(begin) << 8n | BigInt(place - begin)), keys.get(lab[begin]));
          if (place - begin > size) { largest = begin; size = place - begin; }
          begin = place;
        }
      if (!wasActive) active[largest] = 0;
    }

    // look at a new node; return the level whose next child is to be made
    visit(level) {
      const trace = this.trace[level];
      if (this.haveLeaf) {
        const above = level === 0 || this.likeFirst[level - 1];
        this.likeFirst[level] = above && this.firstTrace[level] === trace;
        let versus = level ? this.versusBest[level - 1] : 0;
        if (versus === 0 && trace !== this.bestTrace[level]) versus = trace > this.bestTrace[level] ? 1 : -1;
        this.versusBest[level] = versus;
        if (versus < 0 && !this.likeFirst[level]) return level - 1;
      }
      if (trace & LEAF) return this.leaf(level);
      const starts = this.starts[level];
      let best = 0, size = this.n + 1;
      for (let place = 0; place < this.n;) {
        const end = this.end(starts, place);
        if (1 < end - place && end - place < size) { best = place; size = end - place; }
        place = end;
      }
      this.cell[level] = best;
      this.left[level] = this.lab[level].slice(best, best + size).sort((x, y) => x - y);
      return level;
    }

    leaf(level) {
      const order = this.lab[level], form = this.formOf(order);
      if (!this.haveLeaf) {
        this.haveLeaf = true;
        this.onFirst = level - 1;
        this.firstTrace = this.trace.slice(0, level + 1);
        this.firstPath = this.path.slice(0, level);
        this.firstForm = form;
        this.firstOrder = order;
        this.takeAsBest(level, form);
        return level - 1;
      }
      if (this.likeFirst[level] && compare(form, this.firstForm) === 0) {
        this.automorphism(this.firstOrder, order);
        return this.onFirst;
      }
      const versus = this.versusBest[level];
      if (versus === 0 && compare(form, this.form) === 0) {
        this.automorphism(this.order, order);
        return numbers(level).find(i => this.path[i] !== this.bestPath[i]);
      }
      if (versus > 0 || (versus === 0 && compare(form, this.form) > 0)) this.takeAsBest(level, form);
      return level - 1;
    }

    takeAsBest(level, form) {
      this.form = form;
      this.order = this.lab[level];
      this.bestTrace = this.trace.slice(0, level + 1);
      this.bestPath = this.path.slice(0, level);
      this.versusBest.fill(0, 0, level + 1);
    }

    formOf(order) {
      const position = [];
      order.forEach((vertex, place) => { position[vertex] = 1n << BigInt(place); });
      return this.layers.flatMap(layer => order.map(v => layer[v].reduce((row, u) => row | position[u], 0n)));
    }

    automorphism(source, image) {
      const permutation = [];
      source.forEach((a, k) => { permutation[a] = image[k]; });
      if (merge(this.orbits, permutation)) this.generators.push(permutation);
      else if (this.n > 1) this.others = [...this.others.slice(1 - this.n), permutation];
    }

    next(level) {
      const left = this.left[level];
      if (!left || !left.length) return -1;
      let parent = this.orbits;
      if (this.haveLeaf && level !== this.onFirst) {
        parent = numbers(this.n);
        for (const permutation of [...this.generators, ...this.others])
          if (this.path.slice(0, level).every(vertex => permutation[vertex] === vertex)) merge(parent, permutation);
      }
      while (left.length) {
        const vertex = left.shift();
        if (find(parent, vertex) === vertex) return vertex;
      }
      return -1;
    }
  }

  function compare(x, y) {
    for (let k = 0; k < x.length; k++) if (x[k] !== y[k]) return x[k] < y[k] ? -1 : 1;
    return 0;
  }

  /** {to: canonical place of each link, generators, order (BigInt), orbits, key, canonical}. */
  Atlas.label = function (graph) {
    const most = Math.max(1, ...graph.joints.map(joint => joint[2]));
    const layers = Array.from({length: most}, () => Array.from({length: graph.links}, () => []));
    for (const [a, b, m] of graph.joints) { layers[m - 1][a].push(b); layers[m - 1][b].push(a); }
    const colours = new Array(graph.links).fill(0);
    if (graph.frame !== null) {
      const levels = Atlas.levels(graph);
      colours.fill(levels.length);
      levels.forEach((level, k) => level.forEach(link => { colours[link] = k; }));
    }
    const found = new Search(graph.links, layers, colours).run();
    const to = [];
    found.order.forEach((link, place) => { to[link] = place; });
    const canonical = Atlas.relabelled(graph, to);
    return {
      to, canonical, key: Atlas.encodeKey(canonical), generators: found.generators, orbits: found.orbits,
      order: found.index.reduce((product, size) => product * BigInt(size), 1n),
    };
  };
})();
