// Pictures of the drawing as it is seen: SVG, PNG, DXF, and films of its motion.
"use strict";

(function () {
  const STYLES = ["fill", "stroke", "stroke-width", "stroke-linejoin", "stroke-linecap", "stroke-dasharray", "font-size", "text-anchor", "paint-order"];

  /** A colour that every program reads. */
  const colour = text => {
    const found = /^color\(srgb ([\d.e-]+) ([\d.e-]+) ([\d.e-]+)/.exec(text);
    return found ? `#${found.slice(1).map(own => Math.round(Math.min(1, own) * 255).toString(16).padStart(2, "0")).join("")}` : text;
  };

  /** The drawing as an SVG of its own, in light colours, whatever the page wears. */
  Bench.pictureOf = app => {
    const root = document.documentElement, theme = root.dataset.theme, { view } = app;
    root.dataset.theme = "light";
    const copy = Bench.svg("svg", { xmlns: "http://www.w3.org/2000/svg", viewBox: `0 0 ${view.width} ${view.height}`, width: view.width, height: view.height, "font-family": "sans-serif" });
    copy.append(Bench.svg("rect", { width: view.width, height: view.height, fill: "#ffffff" }));
    for (const name of ["under", "links", "curves", "marks", "points", "motion"]) {
      const live = view.layers[name], made = live.cloneNode(true), from = [...live.querySelectorAll("*")];
      [...made.querySelectorAll("*")].forEach((element, k) => {
        const own = getComputedStyle(from[k]);
        for (const style of STYLES) element.setAttribute(style, colour(own.getPropertyValue(style)));
        element.removeAttribute("class");
        element.removeAttribute("data-id");
      });
      copy.append(made);
    }
    if (theme) root.dataset.theme = theme; else delete root.dataset.theme;
    return new XMLSerializer().serializeToString(copy);
  };

  /** An SVG text on a canvas. */
  async function drawn(text, width, height) {
    const url = URL.createObjectURL(new Blob([text], { type: "image/svg+xml" })), image = new Image();
    try {
      image.src = url;
      await image.decode();
      const canvas = Bench.make("canvas", { width, height });
      canvas.getContext("2d", { willReadFrequently: true }).drawImage(image, 0, 0, width, height);
      return canvas;
    } finally { URL.revokeObjectURL(url); }
  }

  const unchosen = (app, act) => {
    const kept = app.selection;
    app.selection = [];
    app.view.build(app.sheet, { names: app.options.names, grid: false });
    Bench.paintCurves(app, app.motion);
    Bench.paintPose(app, app.motion);
    try { return act(); } finally { app.selection = kept; app.changed("view"); }
  };
  const saved = (app, name, content, type) => {
    Bench.download(name, content, type);
    app.say("said.saved", { file: name });
  };

  Bench.do.svg = app => saved(app, "mechanism.svg", unchosen(app, () => Bench.pictureOf(app)), "image/svg+xml");
  Bench.do.png = async app => {
    const text = unchosen(app, () => Bench.pictureOf(app)), canvas = await drawn(text, Math.round(2 * app.view.width), Math.round(2 * app.view.height));
    canvas.toBlob(blob => saved(app, "mechanism.png", blob), "image/png");
  };
  Bench.do.dxf = app => {
    const { motion } = app, swept = motion && motion.driven ? motion.sweep() : null;
    const paths = swept ? Bench.tracedPoints(app.sheet).map(([, k, at]) => ({ points: Bench.pathOver(motion, k, at).filter(p => p.every(Number.isFinite)), closed: swept.full && swept.turns < Infinity })) : [];
    saved(app, "mechanism.dxf", Bench.toDxf(app.posed(), paths), "image/vnd.dxf");
  };

  /** Pictures of one pass of the motion, each handed to `take` as a canvas. */
  async function filmed(app, count, width, height, take) {
    const { motion, mode } = app;
    if (!motion || !motion.driven) { app.say(motion ? motion.why : "said.noengine"); return false; }
    motion.pause();
    const swept = motion.sweep(), before = motion.input, first = swept.inputs[0], last = swept.inputs[swept.inputs.length - 1];
    for (let k = 0; k < count; k++) {
      // a whole turn goes on; a stroke goes there and back
      const part = swept.full ? k / count : 0.5 - 0.5 * Math.cos((2 * Math.PI * k) / count);
      motion.to(first + part * (last - first), true);
      await take(await drawn(unchosen(app, () => Bench.pictureOf(app)), width, height), k);
      app.say("said.filming", { k: k + 1, n: count });
    }
    motion.to(before, true);
    if (mode === "draw") app.pose = null; // it stands as it was drawn
    app.setMode(mode);
    app.changed("rest");
    return true;
  }
  const sizeOf = (app, most) => {
    const scale = Math.min(1, most / Math.max(app.view.width, app.view.height));
    return [app.view.width, app.view.height].map(own => 2 * Math.round((own * scale) / 2));
  };

  Bench.do.gif = async app => {
    const [width, height] = sizeOf(app, 560), pictures = [];
    const done = await filmed(app, 60, width, height, canvas => pictures.push(canvas.getContext("2d").getImageData(0, 0, width, height).data));
    if (done) saved(app, "mechanism.gif", Bench.toGif(width, height, pictures, 6), "image/gif");
  };
  Bench.do.film = async app => {
    const type = ["video/mp4", "video/webm"].find(own => typeof MediaRecorder !== "undefined" && MediaRecorder.isTypeSupported(own));
    if (!type) { app.fault(new Bench.Fault("fault.film")); return; }
    const [width, height] = sizeOf(app, 1080), canvas = Bench.make("canvas", { width, height }), context = canvas.getContext("2d");
    const recorder = new MediaRecorder(canvas.captureStream(30), { mimeType: type, videoBitsPerSecond: 4e6 }), parts = [];
    recorder.ondataavailable = event => parts.push(event.data);
    const over = new Promise(resolve => { recorder.onstop = resolve; });
    recorder.start();
    const done = await filmed(app, 150, width, height, async picture => {
      context.drawImage(picture, 0, 0);
      await new Promise(resolve => setTimeout(resolve, 33));
    });
    recorder.stop();
    await over;
    if (done) saved(app, `mechanism.${type.slice(6)}`, new Blob(parts, { type }));
  };

  /** Show a program, how to run it, and under which name it is saved. */
  Bench.showPython = (program, about, name) => {
    const box = document.getElementById("snippet"), dialog = document.getElementById("python");
    box.value = program;
    dialog.dataset.name = name;
    document.getElementById("pythonAbout").textContent = Bench.word(about, { name });
    Bench.app.say(about, { name });
    dialog.showModal();
    box.setSelectionRange(0, 0);
    box.scrollTop = 0;
  };
  Bench.do.python = app => Bench.showPython(Bench.toPython(app.posed()), "python.about", "mechanism.py");
  Bench.do.savePython = app => saved(app, document.getElementById("python").dataset.name, document.getElementById("snippet").value, "text/x-python");
  Bench.do.copyPython = async app => {
    const box = document.getElementById("snippet");
    box.select();
    try { await navigator.clipboard.writeText(box.value); app.say("said.copiedtext"); } catch { app.say("said.select"); }
  };
})();
