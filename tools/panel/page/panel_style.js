// SPDX-License-Identifier: MIT
// Options of Tk as styles, set through the CSS object model.

const sides = {
    n: 'start',
    s: 'end',
    w: 'start',
    e: 'end'
};

/// fill, expand and anchor of a box.
export function packStyle(element, pack, horizontal) {
    if (!pack) return;
    const fill = pack.fill ?? 'none', across = horizontal ? 'y' : 'x',
          along = horizontal ? 'x' : 'y';
    if (pack.expand && (fill === along || fill === 'both')) element.style.flexGrow = 1;
    const anchor = pack.anchor ?? 'center',
          side =
              [...anchor].find(c => horizontal ? c === 'n' || c === 's' : c === 'w' || c === 'e');
    element.style.alignSelf = fill === across || fill === 'both' ? 'stretch' :
        anchor !== 'center' && side                              ? `flex-${sides[side]}` :
                                                                   'center';
}

/// Place in a table; sticky is a set of the letters n, s, e, w.
export function cellStyle(element, row, column, rows, columns, sticky = 'ne') {
    element.style.gridArea = `${row} / ${column} / span ${rows} / span ${columns}`;
    const axis = (first, last) => sticky.includes(first) && sticky.includes(last) ? 'stretch' :
        sticky.includes(first)                                                    ? 'start' :
        sticky.includes(last)                                                     ? 'end' :
                                                                                    'center';
    element.style.justifySelf = axis('w', 'e');
    element.style.alignSelf = axis('n', 's');
}

const beyondName = /[^\w -]/;  // characters that a name of a font does not have

function font(element, value) {
    const [family, size, ...rest] = Array.isArray(value) ? value : String(value).split(/\s+/);
    if (family)
        element.style.fontFamily =
            beyondName.test(family) ? 'sans-serif' : `"${family}", sans-serif`;
    const points = Number(size);
    if (points) element.style.fontSize = points > 0 ? `${points}pt` : `${Math.abs(points)}px`;
    const more = rest.join(' ');
    if (/bold/.test(more)) element.style.fontWeight = 'bold';
    if (/italic/.test(more)) element.style.fontStyle = 'italic';
}

const borders = {
    SUNKEN: 'inset',
    sunken: 'inset',
    RAISED: 'outset',
    raised: 'outset',
    GROOVE: 'groove',
    groove: 'groove',
    RIDGE: 'ridge',
    ridge: 'ridge',
    SOLID: 'solid',
    solid: 'solid'
};

export function applyStyle(element, options, widget) {
    const fg = options.fg ?? options.foreground, bg = options.bg ?? options.background;
    if (fg) element.style.color = fg;
    if (bg) {
        element.style.background = bg;
        if (!fg) element.style.color = '#000';  // Tk's text is black, also where this page is dark
    }
    if (options.font) font(element, options.font);
    if (borders[options.relief])
        element.style.border =
            `${Number(options.bd ?? options.borderwidth ?? 2)}px ${borders[options.relief]}`;
    if (Number(options.padx)) element.style.paddingInline = `${options.padx}px`;
    if (Number(options.pady)) element.style.paddingBlock = `${options.pady}px`;
    if (Number(options.width) && !['rectled', 'led'].includes(widget))
        element.style.minWidth = `${options.width}ch`;
    if (options.justify) element.style.textAlign = String(options.justify).toLowerCase();
}
