// Words by their magnetic energy, beside the fold: which of them it ended in, and which is wanted.

const AT_ONCE = 6; // milliseconds of a search between two looks at what else there is to do

class States {
  /** `want` is called with a word that is chosen. */
  constructor(parent, want) {
    Object.assign(this, { parent, want, of: null, found: [] });
  }

  /**
   * Rank the words of a chain, unless they are those of the last one, and mark some.
   *
   * `scene` is the chain's; `isCurrent` says whether it is still asked for.
   */
  async rank(chain, scene, isCurrent) {
    const of = JSON.stringify([scene.sequence, scene.magnets]);
    if (of === this.of) return;
    this.of = null;
    this.parent.ariaBusy = "true";
    const ranking = chain.ranking();
    let part, from = performance.now();
    do {
      part = ranking.next();
      if (performance.now() - from > AT_ONCE) {
        await otherWork();
        if (!isCurrent()) return;
        from = performance.now();
      }
    } while (!part.done);
    Object.assign(this, { of, found: part.value });
    this.parent.ariaBusy = "false";
    this.#build();
  }

  /** Tell which word the chain folded into, and which is wanted. */
  mark(word, wanted) {
    Object.assign(this, { word, wanted });
    for (const row of this.parent.rows) {
      const { word: here, note } = row.dataset;
      row.querySelector("button").setAttribute("aria-pressed", String(here === wanted));
      row.lastElementChild.textContent = here === word ? `${note} · this fold` : note;
      row.toggleAttribute("data-here", here === word);
    }
  }

  #build() {
    this.parent.replaceChildren();
    for (const { word, energy, stable } of this.found) {
      const row = write("tr", "", this.parent);
      row.dataset.word = word;
      row.dataset.note = stable ? "stable" : word.includes("S") ? "not folded" : "equal poles touch";
      const button = write("button", word, write("td", "", row));
      button.type = "button";
      button.title = "Show its outline";
      button.addEventListener("click", () => this.want(word));
      write("td", (1e3 * energy).toFixed(3).replace("-", "−"), row);
      write("td", "", row);
    }
    this.mark(this.word, this.wanted);
  }
}
