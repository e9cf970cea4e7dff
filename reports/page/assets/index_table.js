"use strict";
// Sorting and filtering of the table of logs; without it the table stands worst first.
(function () {
  const table = document.getElementById("logs");
  if (!table) return;
  const body = table.tBodies[0], rows = Array.from(body.rows), heads = Array.from(table.tHead.rows[0].cells);
  const tools = document.querySelector(".tools");
  const field = (kind, label) => {
    const wrap = document.createElement("label"), made = document.createElement(kind);
    wrap.append(label + " ", made);
    tools.append(wrap);
    return made;
  };
  const text = field("input", "Filter"), verdict = field("select", "Verdict");
  text.type = "search";
  for (const [value, words] of [["", "all"], ["fail", "failed"], ["not_judged", "not judged"], ["pass", "passed"]]) {
    verdict.append(new Option(words, value));
  }
  const shown = document.createElement("span");
  shown.setAttribute("role", "status");
  tools.append(shown);
  tools.hidden = false;

  function filter() {
    const words = text.value.toLowerCase().split(/\s+/).filter(Boolean);
    let count = 0;
    for (const row of rows) {
      row.text ??= row.textContent.toLowerCase();
      row.hidden = (verdict.value !== "" && row.dataset.verdict !== verdict.value) || !words.every((w) => row.text.includes(w));
      if (!row.hidden) count++;
    }
    shown.textContent = count + " of " + rows.length + " logs";
  }
  text.addEventListener("input", filter);
  verdict.addEventListener("change", filter);
  filter();

  heads.forEach((head, k) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const falling = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
      for (const other of heads) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", falling === 1 ? "ascending" : "descending");
      const key = (row) => row.cells[k].dataset.key ?? row.cells[k].textContent.trim().toLowerCase();
      const numeric = rows.every((row) => !Number.isNaN(Number(key(row))));
      const compare = numeric ? (a, b) => Number(key(a)) - Number(key(b)) : (a, b) => key(a).localeCompare(key(b));
      body.append(...rows.slice().sort((a, b) => falling * compare(a, b)));
    });
  });
})();
