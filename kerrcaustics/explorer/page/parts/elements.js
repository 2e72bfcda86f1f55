// Elements of the page.

function h(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value !== false && value !== undefined) node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children);
  return node;
}

function button(words, label, act, more = {}) {
  return h("button", { type: "button", "aria-label": label, title: label, onclick: act, ...more }, words);
}

function select(label, values, changed) {
  const options = values.map(([value, words]) => h("option", { value }, words));
  return h("select", { "aria-label": label, onchange: (e) => changed(e.target.value) }, ...options);
}

function canvasOf(name, label) {
  return h("canvas", { tabindex: "0", role: "img", "aria-label": label, class: `kc-canvas kc-${name}` });
}

function panelOf(name, title, canvas, tools) {
  const coarse = h("span", { class: "kc-coarse", hidden: true }, "coarse while you move");
  const head = h("header", {}, h("h2", {}, title), coarse, h("div", { class: "kc-tools" }, ...tools));
  return { canvas, coarse, element: h("section", { class: `kc-panel kc-panel-${name}` }, head, canvas) };
}

function tableOf(titles, lines) {
  const row = (tag, cells) => h("tr", {}, ...cells.map((cell) => h(tag, {}, ...[cell].flat())));
  return [h("thead", {}, row("th", titles)), h("tbody", {}, ...lines.map((line) => row("td", line)))];
}
