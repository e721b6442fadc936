// A curve that is wanted: drawn on the sheet, answered with mechanisms that draw it.
"use strict";

(function () {
  const { make } = Bench, $ = id => document.getElementById(id);

  /** The wanted curve under the drawing. */
  Bench.paintTarget = app => {
    const layer = app.view.layers.target;
    layer.replaceChildren(...(app.target ? [Bench.svg("path", { class: "target", d: Bench.pathOf(app.target.map(at => app.view.px(at)), true) })] : []));
  };

  /** What draws it: sketches of the candidates, each with its error. */
  Bench.answerTarget = async (app, curve) => {
    app.target = curve;
    app.changed("view");
    const length = curve.reduce((sum, p, k) => { const q = curve[(k + 1) % curve.length]; return sum + Math.hypot(p[0] - q[0], p[1] - q[1]); }, 0);
    if (!(length * app.view.camera.scale > 60)) { app.target = null; app.fault(new Bench.Fault("fault.target")); app.changed("view"); return; }
    if (app.work.busy) app.work.stop();
    app.say("said.target", { share: 0 });
    const found = await Bench.job(app, ["curves-data"], "target", [curve], share => app.say("said.target", { share: Math.round(100 * share) }));
    if (!found) return;
    if (!found.length) { app.fault(new Bench.Fault("fault.target")); return; }
    app.candidates = found;
    lay(app, found[0]);
    Bench.do.candidates(app);
  };

  function lay(app, { data, error }) {
    app.attempt(() => ({ sheet: { ...Bench.opened(Bench.checked(data)), unit: app.sheet.unit }, select: [], say: ["said.candidate", { error: Bench.shown(100 * error, 2) }] }));
    Bench.do.fit(app);
  }

  Bench.do.target = app => app.pick("target");
  Bench.do.candidates = app => {
    if (!app.candidates) { app.pick("target"); return; }
    $("candidateList").replaceChildren(...app.candidates.map(own => make("button", { type: "button", on: { click: () => { lay(app, own); $("candidates").close(); } } },
      Bench.still(Bench.opened(Bench.checked(own.data))), make("span", {}, Bench.word("target.error", { n: own.data.pose.length, error: Bench.shown(100 * own.error, 2) })))));
    $("candidates").showModal();
  };
})();
