// Undo and redo: a list of drawings and the place in it.
"use strict";

(function () {
  const MOST = 300;

  Bench.History = class {
    constructor(sheet) { this.all = [sheet]; this.at = 0; }
    get sheet() { return this.all[this.at]; }
    get canUndo() { return this.at > 0; }
    get canRedo() { return this.at < this.all.length - 1; }

    /** Go on with another drawing; what was undone before is forgotten. */
    push(sheet) {
      if (sheet === this.sheet) return;
      this.all = [...this.all.slice(Math.max(0, this.at + 2 - MOST), this.at + 1), sheet];
      this.at = this.all.length - 1;
    }
    undo() { if (this.canUndo) this.at--; return this.sheet; }
    redo() { if (this.canRedo) this.at++; return this.sheet; }
  };
})();
