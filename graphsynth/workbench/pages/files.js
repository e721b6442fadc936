// Opening and saving: files, the address, what the browser keeps for the next time.
"use strict";

(function () {
  /** Hand a file to the reader. */
  Bench.download = (name, content, type) => {
    const url = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
    const link = Bench.make("a", { href: url, download: name });
    document.body.append(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(url), 10000);
  };

  const KEPT = "workbench-drawing";
  const whole = app => Bench.written(app.posed());

  Bench.do.save = app => {
    Bench.download("mechanism.toml", Bench.toToml(whole(app), app.sheet.unit), "application/toml");
    app.say("said.saved", { file: "mechanism.toml" });
  };
  Bench.do.saveJson = app => {
    Bench.download("mechanism.json", Bench.toJson(whole(app)), "application/json");
    app.say("said.saved", { file: "mechanism.json" });
  };

  /** Open a text; what it is not is said in one sentence, and the drawing stays. */
  Bench.openText = (app, text, name = "") => app.attempt(() => {
    const sheet = Bench.fromText(text), unit = Bench.unitOf(text) || app.sheet.unit;
    return { sheet: { ...sheet, unit }, select: [], say: ["said.opened", { file: name.slice(0, 60) }] };
  }) && (Bench.do.fit(app), true);

  Bench.do.open = app => {
    const input = document.getElementById("file");
    input.onchange = () => { if (input.files[0]) Bench.openFile(app, input.files[0]); input.value = ""; };
    input.click();
  };
  Bench.openFile = async (app, file) => {
    if (file.size > 400000) { app.fault(new Bench.Fault("fault.file.long", { most: 400000 })); return; }
    Bench.openText(app, await file.text(), file.name);
  };

  Bench.do.share = async app => {
    try {
      const fragment = await Bench.toFragment(app.posed());
      try { history.replaceState(null, "", fragment); } catch { throw new Bench.Fault("fault.noaddress"); } // in a notebook
      try { await navigator.clipboard.writeText(location.href); app.say("said.shared"); } catch { app.say("said.address"); }
    } catch (fault) {
      if (!(fault instanceof Bench.Fault)) throw fault;
      app.fault(fault);
    }
  };

  /** The drawing of the address; said if it is damaged. */
  Bench.openAddress = async app => {
    if (app.work.busy) app.work.stop(); // what an older address asked for is not wanted any more
    try {
      if (location.hash.startsWith("#k=")) return Bench.layChain(app, ...Bench.chainOfAddress(app, location.hash));
      const template = /^#t=(\w+)$/.exec(location.hash), found = template && Bench.templates.find(own => own.name === template[1]);
      if (found) return Bench.openText(app, found.text, Bench.word(`template.${found.name}`));
      const sheet = await Bench.fromFragment(location.hash);
      if (!sheet) return false;
      app.take(sheet, { select: [], say: ["said.opened", { file: Bench.word("name.address") }] });
      Bench.do.fit(app);
      return true;
    } catch (fault) {
      if (!(fault instanceof Bench.Fault)) throw fault;
      app.fault(fault);
      return false;
    }
  };

  /** The browser keeps the drawing until the next visit. */
  Bench.keep = async app => {
    if (window !== top) return; // on another page it is a picture of that page's mechanism
    try { localStorage.setItem(KEPT, await Bench.toFragment(app.sheet)); } catch { /* no storage: nothing is kept */ }
  };
  Bench.kept = async () => {
    try { return await Bench.fromFragment(localStorage.getItem(KEPT) || ""); } catch { return null; }
  };
})();
