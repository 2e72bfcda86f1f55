/* A button on every block of code, which copies its text without prompts. Where nothing can be copied there is none. */
"use strict";

/* The text of a block. If it has prompts: the lines that were typed, and no output. */
function typedText(text) {
  const lines = text.replace(/\s+$/, "").split("\n");
  const shell = lines.some((line) => line.startsWith("$ "));
  const prompt = lines.some((line) => line.startsWith(">>>")) ? /^(>>>|\.\.\.)( |$)/ : shell ? /^\$ / : null;
  if (prompt === null) return lines.join("\n");
  // A command goes on after a line that ends in a backslash.
  const typed = lines.filter((line, i) => prompt.test(line) || (shell && i > 0 && lines[i - 1].endsWith("\\")));
  return typed.map((line) => line.replace(prompt, "")).join("\n");
}

function addCopyButton(block) {
  const text = block.querySelector("pre");
  if (text === null) return;
  const button = document.createElement("button");
  const say = (word) => {
    button.textContent = word;
    setTimeout(() => { button.textContent = "Copy"; }, 2000);
  };
  button.type = "button";
  button.className = "copy-button";
  button.textContent = "Copy";
  button.setAttribute("aria-live", "polite");
  button.addEventListener("click", () => {
    navigator.clipboard.writeText(typedText(text.textContent)).then(() => say("Copied"), () => say("Not copied"));
  });
  block.append(button);
}

document.addEventListener("DOMContentLoaded", () => {
  if (navigator.clipboard?.writeText) document.querySelectorAll("div.highlight").forEach(addCopyButton);
});
