// A list of words by magnetic energy that marks the word of the fold and the target word.

const AT_ONCE = 6; // milliseconds of a search before the page can do other work

class States {
  /** `want` is called with the word that the user chooses. */
  constructor(parent, want) {
    Object.assign(this, { parent, want, of: null, found: [] });
  }

  /**
   * Rank a chain's words, unless they are already shown, and mark some of them.
   *
   * `scene` is the chain's scene; `isCurrent` returns whether this ranking is still needed.
   */
  async rank(chain, scene, isCurrent) {
    const of = JSON.stringify([scene.sequence, scene.magnets, scene.casing]);
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

  /** Mark the word into which the chain folded, and the target word. */
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
      row.dataset.note = stable ? "stable" : word.includes("S") ? "not folded" : "like poles touch";
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
