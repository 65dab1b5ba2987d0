// SPDX-License-Identifier: MIT
// Finds sections that contain all typed words. The index is loaded when the box is first used; it
// is a script, so that it also loads from a file.
const top_ = document.currentScript.dataset.top;
const narrow = matchMedia("(max-width: 52rem)");
const menu = document.querySelector("nav details");
const fold = () => {
    menu.open = !narrow.matches;
};
narrow.addEventListener("change", fold);
fold();
document.querySelector("nav a[aria-current]")?.scrollIntoView({block: "nearest"});

const finder = document.getElementById("finder"), box = document.getElementById("search"),
      list = document.getElementById("found");
finder.hidden = false;

let loading;
function index() {
    loading ??= new Promise((resolve, reject) => {
        const script = document.createElement("script");
        script.src = top_ + "search-index.js";
        script.onload = () =>
            resolve(window.halcyonIndex.map(([page, heading, address, text]) => ({
                                                page,
                                                heading,
                                                address,
                                                text,
                                                title: `${page} ${heading}`.toLowerCase(),
                                                words: text.toLowerCase()
                                            })));
        script.onerror = reject;
        document.head.append(script);
    });
    return loading;
}

/**
 * Returns a weight, 0 when a word is missing: an exact page title first, then titles, then texts.
 */
function weight(entry, words) {
    let sum = 0;
    for (const word of words) {
        if (entry.title.includes(word))
            sum += entry.title.split(/\W+/).includes(word) ? 30 : 15;
        else if (entry.words.includes(word))
            sum += 1;
        else
            return 0;
    }
    return sum +
        (entry.page.toLowerCase() === words.join(" ") ? (entry.address.includes("#") ? 40 : 100) :
                                                        0);
}

function excerpt(entry, word) {
    const at = Math.max(0, entry.words.indexOf(word) - 40);
    return (at > 0 ? "…" : "") + entry.text.slice(at, at + 120);
}

async function find() {
    const words = box.value.toLowerCase().split(/\s+/).filter(Boolean);
    const entries = words.length ? await index() : [];
    const found = entries.map(entry => [weight(entry, words), entry])
                      .filter(([w]) => w > 0)
                      .sort((a, b) => b[0] - a[0])
                      .slice(0, 30);
    list.replaceChildren(...found.map(([, entry]) => {
        const item = document.createElement("li"), link = document.createElement("a"),
              small = document.createElement("small");
        link.href = top_ + entry.address;
        link.textContent = entry.heading && entry.heading !== entry.page ?
            `${entry.page} › ${entry.heading}` :
            entry.page;
        small.textContent = excerpt(entry, words[0]);
        link.append(small);
        item.append(link);
        return item;
    }));
    if (words.length && !found.length) list.textContent = "nothing found";
    list.hidden = !words.length;
}

box.addEventListener("focus", index);
box.addEventListener("input", find);
addEventListener("keydown", event => {
    const links = [...list.querySelectorAll("a")], at = links.indexOf(document.activeElement);
    if (event.key === "/" && document.activeElement !== box)
        event.preventDefault(), box.focus();
    else if (event.key === "Escape")
        box.value = "", find(), box.blur();
    else if (list.hidden)
        return;
    else if (event.key === "ArrowDown")
        event.preventDefault(), links[Math.min(at + 1, links.length - 1)]?.focus();
    else if (event.key === "ArrowUp")
        event.preventDefault(), at > 0 ? links[at - 1].focus() : box.focus();
    else if (event.key === "Enter" && document.activeElement === box)
        links[0]?.click();
});
