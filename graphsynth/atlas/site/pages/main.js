// Addresses, colours, and small things that several pages use.
"use strict";

(function () {
  const ROMAN = ["", "I", "II", "III", "IV", "V", "VI", "VII", "VIII", "IX", "X", "XI", "XII"];
  Atlas.roman = own => (own === undefined ? "not computed" : ROMAN[own] || String(own));
  Atlas.count = value => String(value).replace(/\B(?=(\d{3})+$)/g, "\u202f");
  Atlas.classes = row => (!row.low ? "not computed" : row.low === row.high ? Atlas.roman(row.low) : `${Atlas.roman(row.low)}–${Atlas.roman(row.high)}`);

  let first = true, searching = false;

  function decoded(text) {
    try { return decodeURIComponent(text); } catch { return text; }
  }

  async function route() {
    const [path, words = ""] = location.hash.replace(/^#\/?/, "").split("?");
    const name = decoded(path), parameters = new URLSearchParams(words);
    const page = name === "" ? "browse" : name === "find" || name === "about" ? name : "entry";
    const scroll = Atlas.scrolled;
    if (!document.getElementById("browse").hidden) Atlas.scrolled = scrollY;
    for (const section of document.querySelectorAll("main > section")) section.hidden = section.id !== page;
    for (const link of document.querySelectorAll("nav a"))
      if (link.dataset.page === page) link.setAttribute("aria-current", "page"); else link.removeAttribute("aria-current");
    let title = "";
    if (page === "browse") {
      scrollTo(0, (await Atlas.browse(parameters)) ? scroll || 0 : 0);
      if (searching) Atlas.search();
      searching = false;
    } else if (page === "entry") title = await Atlas.entry(name, parameters);
    else title = page === "find" ? Atlas.openFind() : Atlas.about();
    if (title === null) return;
    document.title = title ? `${title} · Atlas of kinematic chains` : "Atlas of kinematic chains";
    if (page !== "browse") {
      if (!first) scrollTo(0, 0);
      const head = document.querySelector(`#${page} h1`);
      if (head && !first) head.focus({preventScroll: true});
    }
    first = false;
  }

  addEventListener("DOMContentLoaded", async function () {
    const theme = document.getElementById("theme"), root = document.documentElement;
    theme.value = root.dataset.theme || "auto";
    theme.addEventListener("change", () => {
      root.dataset.theme = theme.value;
      try { localStorage.setItem("atlas-theme", theme.value); } catch { /* no storage: for this visit only */ }
    });
    document.querySelector(".skip").addEventListener("click", event => {
      event.preventDefault(); // the part after # is the address of a chain
      document.getElementById("page").focus();
    });
    history.scrollRestoration = "manual";
    Atlas.startGlossary();
    try { await Atlas.ready(); } catch (error) {
      document.getElementById("page").textContent = `This page needs WebAssembly. ${error.message}`;
      return;
    }
    addEventListener("hashchange", route);
    document.addEventListener("keydown", event => {
      if (event.key !== "/" || event.target.closest("input, textarea, select")) return;
      event.preventDefault();
      searching = document.getElementById("browse").hidden;
      if (searching) location.hash = "#/"; else Atlas.search();
    });
    route();
  });
})();
