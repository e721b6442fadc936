// A picture under the drawing, to trace: read from a file, scaled by two places whose distance is known.
"use strict";

(function () {
  const MOST = 20e6, KINDS = ["image/png", "image/jpeg", "image/webp", "image/gif"];

  function read(app, file) {
    if (!KINDS.includes(file.type) || file.size > MOST) { app.fault(new Bench.Fault("fault.picture", { most: MOST / 1e6 })); return; }
    const reader = new FileReader(), image = new Image();
    reader.onload = () => { image.src = reader.result; };
    image.onerror = () => app.fault(new Bench.Fault("fault.picture", { most: MOST / 1e6 }));
    image.onload = () => {
      const { view } = app, width = (0.7 * view.width) / view.camera.scale, height = (width * image.height) / image.width;
      app.background = { href: image.src, x: view.camera.x - width / 2, y: view.camera.y + height / 2, width, height };
      app.changed("view");
      app.pick("picture");
    };
    reader.readAsDataURL(file);
  }

  Bench.do.picture = app => {
    const input = document.getElementById("image");
    input.onchange = () => { if (input.files[0]) read(app, input.files[0]); input.value = ""; };
    input.click();
  };
  Bench.do.noPicture = app => { app.background = null; app.changed("view"); };

  /** Scale the picture so that two places on it have a given distance; the first stays where it is. */
  Bench.scaledPicture = (picture, [p, q], length) => {
    const factor = length / Math.hypot(q.x - p.x, q.y - p.y);
    return {
      ...picture, x: p.x + (picture.x - p.x) * factor, y: p.y + (picture.y - p.y) * factor,
      width: picture.width * factor, height: picture.height * factor,
    };
  };

  /** Ask for the distance of two picked places. */
  Bench.askScale = (app, picks) => {
    if (!app.background) { Bench.do.picture(app); return; }
    const dialog = document.getElementById("scale"), input = document.getElementById("distance");
    input.value = Bench.shown(Math.hypot(picks[1].x - picks[0].x, picks[1].y - picks[0].y)).replace("−", "-");
    document.getElementById("distanceUnit").textContent = Bench.unitName(app.sheet.unit);
    dialog.showModal();
    input.select();
    dialog.onclose = () => {
      if (dialog.returnValue !== "yes") return;
      dialog.returnValue = "";
      const length = Bench.parseLength(input.value, app.sheet.unit);
      if (!(length > 0)) { app.fault(new Bench.Fault("fault.typed", { text: input.value.slice(0, 20) })); return; }
      app.background = Bench.scaledPicture(app.background, picks, length);
      app.changed("view");
      app.pick("link");
    };
  };

  /** Show it under everything. */
  Bench.paintPicture = app => {
    const { background, view } = app, layer = view.layers.under;
    if (!background) { layer.replaceChildren(); return; }
    const [x, y] = view.px([background.x, background.y]), { scale } = view.camera;
    const image = layer.firstChild && layer.firstChild.getAttribute("href") === background.href ? layer.firstChild
      : Bench.svg("image", { class: "picture", href: background.href, preserveAspectRatio: "none" });
    for (const [name, value] of Object.entries({ x, y, width: background.width * scale, height: background.height * scale })) image.setAttribute(name, value);
    if (image !== layer.firstChild) layer.replaceChildren(image);
  };
})();
