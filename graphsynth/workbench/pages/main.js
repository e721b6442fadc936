// The page comes together: buttons, menus, panels, languages, colours.
"use strict";

(function () {
  const { make } = Bench, $ = id => document.getElementById(id);

  /** Icons of the tools, drawn on 24 by 24. */
  const ICONS = {
    select: "M5 3L18 12L12.5 13L16 20L13.5 21L10 14L6 18Z",
    link: "M5 19L19 5M5 19m-2.5 0a2.5 2.5 0 1 0 5 0a2.5 2.5 0 1 0 -5 0M19 5m-2.5 0a2.5 2.5 0 1 0 5 0a2.5 2.5 0 1 0 -5 0",
    plate: "M4 19L20 19L12 5ZM4 19m-2 0a2 2 0 1 0 4 0a2 2 0 1 0 -4 0M20 19m-2 0a2 2 0 1 0 4 0a2 2 0 1 0 -4 0M12 5m-2 0a2 2 0 1 0 4 0a2 2 0 1 0 -4 0",
    ground: "M12 5L6 15H18ZM4 15H20M7 15L4 19M12 15L9 19M17 15L14 19",
    slider: "M7 8H17V15H7ZM3 18H21M6 18L4 21M12 18L10 21M18 18L16 21",
    slot: "M4 9A3 3 0 0 0 4 15H20A3 3 0 0 0 20 9ZM12 12m-2.5 0a2.5 2.5 0 1 0 5 0a2.5 2.5 0 1 0 -5 0",
    gears: "M8 13m-5.5 0a5.5 5.5 0 1 0 11 0a5.5 5.5 0 1 0 -11 0M17.5 8m-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0M8 13h.1M17.5 8h.1",
    cam: "M9 21A7 7 0 0 1 5 9C7 5 13 5 16 9C18 12 17 21 9 21M10 14h.1M17 5m-3 0a3 3 0 1 0 6 0a3 3 0 1 0 -6 0",
    driver: "M17 7A7 7 0 1 0 19 12M19 12L21.5 9M19 12L16 10M12 12h.1",
    trace: "M3 17C7 3 12 3 13 10C14 18 19 18 21 9M13 10m-2 0a2 2 0 1 0 4 0a2 2 0 1 0 -4 0",
    picture: "M3 5H21V19H3ZM3 16L8 11L12 15L15 12L21 17M15.5 8.5m-1.5 0a1.5 1.5 0 1 0 3 0a1.5 1.5 0 1 0 -3 0",
    target: "M4 14C4 6 10 3 15 5C21 8 20 18 14 19C8 20 4 19 4 14M12 12h.1M12 12m-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0",
    poses: "M3 20L11 16M3 20L5 12M3 20m-1.5 0a1.5 1.5 0 1 0 3 0a1.5 1.5 0 1 0 -3 0M12 10L20 12M12 10L14 3M12 10m-1.5 0a1.5 1.5 0 1 0 3 0a1.5 1.5 0 1 0 -3 0",
    measure: "M3 15L15 3L21 9L9 21ZM7 11L9 13M10 8L13 11M13 5L15 7",
  };
  const icon = name => Bench.svg("svg", { viewBox: "0 0 24 24", width: 22, height: 22, "aria-hidden": "true" }, Bench.svg("path", { d: ICONS[name] }));

  function toolbar(app) {
    Bench.refill($("tools"), ...Object.entries(Bench.TOOLS).map(([name, { key }]) => {
      const title = Bench.word("tool.tip", { name: Bench.word(`tool.${name}`), key: key.toUpperCase() });
      const pressed = app.tool === name && app.mode === "draw";
      return make("button", { type: "button", title, "aria-label": title, "aria-pressed": String(pressed), "data-tool": name, "aria-keyshortcuts": key,
        on: { click: () => app.pick(name) } }, icon(name), make("span", {}, Bench.word(`tool.${name}`)));
    }));
  }

  /** Put the words of the language wherever the page asks for one. */
  function translate() {
    document.documentElement.lang = Bench.language();
    document.title = Bench.word("page.title");
    for (const [data, put] of [["word", (e, t) => { e.textContent = t; }], ["label", (e, t) => e.setAttribute("aria-label", t)],
      ["tip", (e, t) => { e.title = t; }]]) {
      for (const element of document.querySelectorAll(`[data-${data}]`)) put(element, Bench.word(element.dataset[data]));
    }
  }

  /** The list of keys in the help. */
  function help() {
    const tools = Object.entries(Bench.TOOLS).map(([name, { key }]) => [key.toUpperCase(), Bench.word(`hint.${name}`)]);
    const shown = key => (key.length > 2 ? key : key.toUpperCase()).replace("^", "Ctrl ").replace(/^ $/, Bench.word("key.space"));
    const seen = new Set(), keys = Object.entries(Bench.KEYS).filter(([, name]) => !seen.has(name) && seen.add(name))
      .map(([key, name]) => [shown(key), Bench.word(`do.${name}`)]);
    $("keys").replaceChildren(...[...tools, ...keys].map(([key, text]) =>
      make("div", {}, make("dt", {}, make("kbd", {}, key)), make("dd", {}, text))));
  }

  function templates(app) {
    $("templates").replaceChildren(...Bench.templates.map(({ name, text }) => make("button", { type: "button", "data-template": name, on: { click: () => {
      if (Bench.openText(app, text, Bench.word(`template.${name}`))) $("gallery").close();
    } } }, Bench.still(Bench.fromText(text)), make("span", {}, Bench.word(`template.${name}`)))));
  }
  Bench.do.templates = () => $("gallery").showModal();

  /** A small picture of a drawing. */
  Bench.still = sheet => {
    const root = Bench.svg("svg", { class: "still", viewBox: "0 0 160 110", "aria-hidden": "true" });
    const view = new Bench.View(root);
    Object.assign(view, { width: 320, height: 220 });
    root.setAttribute("viewBox", "0 0 320 220");
    view.fit(Bench.box(sheet));
    view.build(sheet, { names: false, grid: false });
    return root;
  };

  /** A store that may not be there. */
  const remembered = (key, value) => {
    try { if (value === undefined) return localStorage.getItem(key); localStorage.setItem(key, value); } catch { /* none */ }
    return null;
  };

  function settings(app) {
    const language = $("language"), theme = $("theme"), unit = $("unit");
    language.replaceChildren(...Bench.languages().map(name => make("option", { value: name, selected: name === Bench.language() }, Bench.word(`language.${name}`))));
    language.onchange = () => { Bench.speak(language.value); remembered("workbench-language", language.value); speak(app); app.say(`hint.${app.tool}`); };
    theme.value = document.documentElement.dataset.theme || "auto";
    theme.onchange = () => { document.documentElement.dataset.theme = theme.value; remembered("workbench-theme", theme.value); };
    unit.replaceChildren(...Bench.UNITS.map(name => make("option", { value: name }, Bench.unitName(name))));
    unit.onchange = () => app.attempt(sheet => ({ sheet: Bench.inUnit(sheet, unit.value) }));
  }

  function speak(app) {
    translate();
    help();
    templates(app);
    settings(app);
    $("chainList").replaceChildren(); // listed anew when it is opened
    app.changed("tool");
    app.changed("sheet");
  }

  function menus(app) {
    for (const element of document.querySelectorAll("[data-do]")) {
      element.addEventListener("click", event => {
        const menu = element.closest("details");
        if (menu) menu.open = false;
        if (menu && !event.detail) menu.firstElementChild.focus(); // from the keyboard: what was hidden has no focus
        Bench.do[element.dataset.do](app);
      });
    }
    const all = [...document.querySelectorAll("details.menu")];
    for (const menu of all) {
      menu.addEventListener("toggle", () => { if (menu.open) all.forEach(other => { if (other !== menu) other.open = false; }); });
      menu.addEventListener("keydown", event => {
        if (event.key === "Escape") { menu.open = false; menu.firstElementChild.focus(); event.stopPropagation(); }
      });
    }
    document.addEventListener("pointerdown", event => all.forEach(menu => { if (!menu.contains(event.target)) menu.open = false; }));
    for (const dialog of document.querySelectorAll("dialog")) {
      dialog.addEventListener("click", event => { if (event.target === dialog || event.target.dataset.close !== undefined) dialog.close(); });
    }
    document.addEventListener("dragover", event => event.preventDefault());
    document.addEventListener("drop", event => {
      event.preventDefault();
      if (event.dataTransfer.files[0]) Bench.openFile(app, event.dataTransfer.files[0]);
    });
  }

  /** What a reader who sees nothing should know of the drawing. */
  function describe(app) {
    const { sheet } = app, links = Object.keys(sheet.links).length;
    const joints = Bench.written(sheet).joints.length;
    $("sheet").setAttribute("aria-label", Bench.word("sheet.label", { links, joints, drivers: sheet.drivers.length, mode: Bench.word(`mode.${app.mode}`) }));
  }

  /** Everything that is no part of the drawing in the unit that the drawing has now. */
  function sameUnit(app, state) {
    const { view: { camera }, background, target, poses, sheet: { unit } } = app, by = Bench.UNIT_SIZE[state.unit] / Bench.UNIT_SIZE[unit];
    state.unit = unit;
    if (by === 1) return;
    const times = ([x, y, ...more]) => [x * by, y * by, ...more];
    Object.assign(camera, { x: camera.x * by, y: camera.y * by, scale: camera.scale / by });
    for (const key of ["x", "y", "width", "height"]) if (background) background[key] *= by;
    if (target) app.target = { ...target, curve: target.curve.map(times) };
    if (poses) app.poses = poses.map(times);
    app.jamming.end *= by;
  }

  function show(app, stage) {
    const state = { unit: app.sheet.unit };
    app.on("sheet", () => sameUnit(app, state));
    let asked = false;
    const paint = () => {
      asked = false;
      const { options } = app;
      app.view.build(app.sheet, { selection: app.selection, names: options.names, grid: options.grid, faulty: app.faulty });
      Bench.paintPicture(app);
      Bench.paintTarget(app);
      Bench.paintCurves(app, app.motion);
      Bench.paintPose(app, app.motion);
      stage.over();
    };
    const soon = () => { if (!asked) { asked = true; requestAnimationFrame(paint); } };
    app.on("sheet view tool draft", soon);
    app.on("sheet view tool draft pose rest", () => { app.view.pose = app.pose; });
    app.on("pose", () => {
      app.view.show(app.sheet);
      Bench.paintPose(app, app.motion);
    });
    app.on("rest", soon);
    app.on("sheet rest", () => { if (!app.motion || !app.motion.playing) Bench.showKnown(app, $("known")); });
    app.on("sheet view tool rest", kind => {
      Bench.showPanel(app, $("chosen"));
      $("undo").disabled = !app.history.canUndo;
      $("redo").disabled = !app.history.canRedo;
      $("unit").value = app.sheet.unit;
      $("empty").hidden = Object.keys(app.sheet.points).length > 0 || app.tool === "target" || app.tool === "poses";
      if (kind === "tool") toolbar(app);
      if (kind !== "view") describe(app);
      document.body.dataset.mode = app.mode;
      for (const [name, on] of Object.entries(app.options)) document.querySelector(`[data-do=${name}]`).setAttribute("aria-pressed", String(on));
      for (const element of document.querySelectorAll("[data-mode]")) if (element !== document.body) element.setAttribute("aria-pressed", String(element.dataset.mode === app.mode));
    });
    let later = 0;
    app.on("sheet", () => { clearTimeout(later); later = setTimeout(() => Bench.keep(app), 500); });
    new ResizeObserver(() => {
      app.view.resize();
      // what was shown whole, and has not been changed or moved since, is shown whole again
      if (app.fitted && app.fitted.sheet === app.sheet && app.fitted.camera === JSON.stringify(app.view.camera)) Bench.do.fit(app);
      else soon();
    }).observe(app.view.root);
  }

  async function start() {
    const app = new Bench.App();
    Bench.app = app;
    const asked = remembered("workbench-language") || navigator.language.slice(0, 2);
    Bench.speak(asked);
    app.view = new Bench.View($("sheet"));
    app.view.resize();
    const stage = Bench.stage = new Bench.Stage(app, app.view);
    show(app, stage);
    menus(app);
    Bench.listen(app);
    for (const element of document.querySelectorAll("[data-mode]")) if (element !== document.body) element.addEventListener("click", () => app.setMode(element.dataset.mode));
    app.jamming = new Bench.Jamming(app, $("binding"));
    Bench.charts(app, $("charts"));
    app.work = Work.start(Mathematics);
    try {
      app.labels = await Kernels.load("labels");
      if (typeof Engine !== "undefined") {
        app.motion = new Bench.Motion(app, await Kernels.load("motion"));
        Bench.player(app);
      }
    } catch (error) { app.fault(new Bench.Fault("fault.kernels", { error: String(error.message).slice(0, 80) })); }
    speak(app);
    if (!(await Bench.openAddress(app))) {
      const first = Bench.given ? Bench.fromText(Bench.given) : location.hash ? null : await Bench.kept();
      if (first && Object.keys(first.points).length) {
        app.history = new Bench.History(first);
        app.changed("sheet");
        Bench.do.fit(app);
      }
    }
    addEventListener("hashchange", () => Bench.openAddress(app));
    document.body.dataset.ready = "";
  }
  start();
})();
