// Words with a meaning of their own: pointed at, focused or tapped, each says what it means.

// shown: as the page writes it.
function term(name, shown = name) {
  return h("dfn", { class: "kc-term", tabindex: "0", "data-term": name }, shown);
}

class Terms {
  constructor(root, tip) {
    Object.assign(this, { tip, meanings: {}, described: null });
    tip.element.id = "kc-tip";
    const on = (name, act) => root.addEventListener(name, (event) => act(event, event.target.closest?.("[data-term]")));
    for (const name of ["pointerover", "focusin"]) on(name, (_, node) => node && this.tell(node));
    for (const name of ["pointerout", "focusout"]) on(name, (_, node) => node && this.hide());
    on("click", (event, node) => {
      if (!node) return;
      // In a label it would go on to what is labelled, and in a summary open it.
      event.preventDefault();
      this.tell(node);
    });
    on("keydown", ({ key }) => key === "Escape" && this.hide());
  }
  // A text with the first of each of its terms marked.
  marked(text) {
    const names = Object.keys(this.meanings).sort((a, b) => b.length - a.length);
    if (!names.length) return [text];
    const marks = new Set();
    return text.split(new RegExp(`\\b((?:${names.join("|")})s?)\\b`)).map((part, i) => {
      const name = part in this.meanings ? part : part.slice(0, -1);
      if (i % 2 === 0 || marks.has(name)) return part;
      marks.add(name);
      return term(name, part);
    });
  }
  tell(node) {
    const meaning = this.meanings[node.dataset.term];
    if (!meaning) return;
    this.hide();
    const { left, bottom } = node.getBoundingClientRect();
    this.tip.show([node.dataset.term, meaning], { clientX: left - 14, clientY: bottom - 10 });
    node.setAttribute("aria-describedby", this.tip.element.id);
    this.described = node;
  }
  hide() {
    this.described?.removeAttribute("aria-describedby");
    this.described = null;
    this.tip.hide();
  }
}
