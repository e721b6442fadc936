// The colours chosen before, set before anything is shown.
"use strict";
try { document.documentElement.dataset.theme = localStorage.getItem("workbench-theme") || "auto"; } catch { /* no storage: follow the system */ }
