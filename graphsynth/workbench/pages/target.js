// What is wanted: a curve drawn on the sheet, or poses of a body; answered with mechanisms.
"use strict";

(function () {
  const { make, svg } = Bench, $ = id => document.getElementById(id), MOST = 5, FLAG = 46;
  /** An end this near its beginning, in sizes of the stroke, closes a curve. */
  const CLOSED = 0.15;

  /** The wanted curve and poses under the drawing. */
  Bench.paintTarget = app => {
    const { target } = app, parts = target ? [svg("path", { class: "target", d: Bench.pathOf(target.curve.map(at => app.view.px(at)), target.closed) })] : [];
    app.view.layers.target.replaceChildren(...parts, ...(app.poses || []).flatMap((pose, k) => flag(app.view, pose, k + 1)));
  };

  /** A pose: an arrow along the body and a short stroke across it. */
  function flag(view, [x, y, turn], number) {
    const [u, v] = view.px([x, y]), c = Math.cos(turn), s = -Math.sin(turn), at = (along, across) => [u + along * c + across * s, v + along * s - across * c];
    return [svg("path", { class: "pose", d: `${Bench.pathOf([at(0, FLAG / 3), [u, v], at(FLAG, 0)])}${Bench.pathOf([at(FLAG - 9, 6), at(FLAG, 0), at(FLAG - 9, -6)])}` }),
      svg("text", { class: "letter", x: u - 16, y: v + 5 }, String(number))];
  }

  /** Look for mechanisms in the worker; the best is laid on the table, all are kept for the list. */
  async function answer(app, needs, name, args, said, why) {
    const { unit } = app.sheet;
    if (app.work.busy) app.work.stop();
    app.say(said, { share: 0 });
    const found = await Bench.job(app, needs, name, args, share => app.say(said, { share: Math.round(100 * share) }));
    if (!found) return;
    if (!found.length) { app.fault(new Bench.Fault(why)); return; }
    app.candidates = found.map(own => ({ ...own, unit }));
    lay(app, app.candidates[0]);
    Bench.do.candidates(app);
  }

  Bench.answerTarget = (app, curve) => {
    const size = Turning.extent(curve), [p, q] = [curve[0], curve[curve.length - 1]], closed = Math.hypot(p[0] - q[0], p[1] - q[1]) <= CLOSED * size;
    const small = !(size * app.view.camera.scale > 20) || curve.length < 4;
    app.target = small ? null : { curve, closed };
    app.changed("view");
    if (small) { app.fault(new Bench.Fault("fault.target")); return null; }
    return answer(app, ["curves-data"], "target", [curve, closed], "said.target", "fault.target");
  };

  /** One pose more, from a place and the direction in which the stroke goes. */
  Bench.addPose = (app, from, to) => {
    const poses = app.poses || [];
    if (poses.length === MOST) { app.fault(new Bench.Fault("fault.poses.many", { n: MOST })); return; }
    const tidy = value => Number(value.toPrecision(6)), turn = Math.hypot(to.x - from.x, to.y - from.y) > 0 ? Math.atan2(to.y - from.y, to.x - from.x) : 0;
    app.poses = [...poses, [tidy(from.x), tidy(from.y), tidy(turn)]];
    app.changed("view");
    app.say("said.pose", { n: app.poses.length });
  };

  /** The poses in numbers, and what can be done with them. */
  Bench.posePanel = app => {
    const poses = app.poses || [], { unit } = app.sheet, tidy = value => String(Number(value.toPrecision(8)));
    const set = (k, c, value) => { app.poses = poses.map((own, n) => (n === k ? Object.assign([...own], { [c]: value }) : own)); app.changed("view"); };
    const rows = poses.flatMap(([x, y, turn, own], k) => [make("h3", {}, Bench.word("panel.pose", { n: k + 1 })),
      Bench.field(app, "panel.x", tidy(x), text => set(k, 0, Bench.typedLength(text, unit)), { unit }),
      Bench.field(app, "panel.y", tidy(y), text => set(k, 1, Bench.typedLength(text, unit)), { unit }),
      Bench.field(app, "panel.angle", tidy((turn * 180) / Math.PI), text => set(k, 2, Bench.typedAngle(text)), { unit: "°" }),
      k > 0 && Bench.field(app, "panel.turned", own === undefined ? "" : tidy((own * 180) / Math.PI), text => set(k, 3, text.trim() ? Bench.typedAngle(text) : undefined), { unit: "°" })].filter(Boolean));
    const drop = left => () => { app.poses = left; app.changed("view"); };
    return [make("p", { class: "soft" }, Bench.word("hint.poses")), ...rows, make("div", { class: "acts" },
      poses.length > 1 && Bench.button("do.passing", () => Bench.do.passing(app), { "data-passing": true }),
      poses.length > 0 && Bench.button("do.lastPose", drop(poses.slice(0, -1))), poses.length > 0 && Bench.button("do.noPoses", drop([])))];
  };

  Bench.do.passing = app => {
    const poses = app.poses || [];
    if (poses.length < 2) { app.fault(new Bench.Fault("fault.poses.few")); return null; }
    const turns = poses.slice(1).map(pose => pose[3]), timed = turns.some(own => own !== undefined), steps = turns.map((own, k) => own - (k ? turns[k - 1] : 0));
    const fit = turns.length < 3 && (steps.every(own => own > 0) || steps.every(own => own < 0)) && Math.abs(turns[turns.length - 1]) < 2 * Math.PI;
    if (timed && !fit) { app.fault(new Bench.Fault("fault.poses.turns")); return null; }
    return answer(app, ["design.wasm"], "passing", [poses.map(pose => pose.slice(0, 3)), timed ? turns : null], "said.passing", "fault.passing");
  };

  const told = ({ error, quality, data }) => (error === undefined ? Bench.word("passing.quality", { angle: Bench.shown((Math.asin(quality) * 180) / Math.PI, 2) })
    : Bench.word("target.error", { n: data.pose.length, error: Bench.shown(100 * error, 2) }));

  function lay(app, own) {
    const say = own.error === undefined ? ["said.passed", { text: told(own) }] : ["said.candidate", { error: Bench.shown(100 * own.error, 2) }];
    app.attempt(() => ({ sheet: Bench.inUnit({ ...Bench.opened(Bench.checked(own.data)), unit: own.unit }, app.sheet.unit), select: [], say }));
    Bench.do.fit(app);
  }

  Bench.do.target = app => app.pick("target");
  Bench.do.candidates = app => {
    if (!app.candidates) { app.pick("target"); return; }
    $("candidateAbout").textContent = Bench.word(app.candidates[0].error === undefined ? "passing.about" : "target.about");
    $("candidateList").replaceChildren(...app.candidates.map(own => make("button", { type: "button", on: { click: () => { lay(app, own); $("candidates").close(); } } },
      Bench.still(Bench.opened(Bench.checked(own.data))), make("span", {}, told(own)))));
    $("candidates").showModal();
  };
})();
