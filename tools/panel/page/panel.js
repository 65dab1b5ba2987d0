// SPDX-License-Identifier: MIT
// User panels: the tree of widgets from the server, with the values of its pins.
import {on, state, subscribe, tell} from './link.js';
import {h, text} from './dom.js';
import {applyStyle, cellStyle, packStyle} from './panel_style.js';
import {makers} from './widgets.js';

/// What widgets see of the panel: pins with values, and functions that are called when they change.
export class Pins {
    constructor(panel) {
        this.panel = panel;
        this.values = new Map(Object.entries(panel.pins).map(([name, pin]) => [name, pin.value]));
        this.bound = new Map();
        this.sources = new Map();
        this.waiting = {};
        this.ready = false;
        this.release = [];  // called when the page is hidden or left
        this.ends = [];     // called when the view is left
    }
    value(name) { return this.values.get(name); }
    /// Calls act(value) now and at each change.
    bind(name, act) {
        if (!name) return;
        if (!this.bound.has(name)) this.bound.set(name, []);
        this.bound.get(name).push(act);
        act(this.values.get(name));
    }
    /// The same for a name of the machine, without a pin of the panel.
    source(name, act) {
        if (!this.sources.has(name)) this.sources.set(name, []);
        this.sources.get(name).push(act);
    }
    set(name, value) {
        this.values.set(name, value);
        for (const act of this.bound.get(name) ?? [])
            act(value);
    }
    /// Sets an output; all that is set until the next frame is one message.
    write(values) {
        if (!state.held) return;
        for (const [name, value] of Object.entries(values))
            this.set(name, value);
        if (Object.keys(this.waiting).length === 0)
            queueMicrotask(() => {
                tell({panel: {write: this.waiting}});
                this.waiting = {};
                this.ready = false;
                this.release = [];  // called when the page is hidden or left
                this.ends = [];     // called when the view is left
            });
        Object.assign(this.waiting, values);
    }
}

function container(node, pins, path) {
    const horizontal = node.widget === 'hbox' || node.horizontal, options = node.options ?? {};
    const element =
        h(node.widget === 'labelframe' ? 'fieldset' : 'div',
          {class: `w-box ${horizontal ? 'w-hbox' : 'w-vbox'}`});
    if (node.widget === 'labelframe') element.append(h('legend', {}, options.text ?? ''));
    for (const [i, child] of (node.children ?? []).entries()) {
        const one = build(child, pins, `${path}.${i}`);
        packStyle(one, child.pack, horizontal);
        element.append(one);
    }
    return element;
}

function table(node, pins, path) {
    const element = h('div', {class: 'w-table'}), options = node.options ?? {}, taken = new Set();
    let row = 0, column = 0, most = 1;
    for (const [i, child] of node.children.entries()) {
        if (child.widget === 'tablerow') {
            row++;
            column = 0;
            continue;
        }
        if (row === 0) row = 1;
        do
            column++;
        while (taken.has(`${row},${column}`));
        const rows = child.span?.rows ?? 1, columns = child.span?.columns ?? 1;
        for (let r = 0; r < rows; r++)
            for (let c = 0; c < columns; c++)
                taken.add(`${row + r},${column + c}`);
        most = Math.max(most, column + columns - 1);
        const one = build(child, pins, `${path}.${i}`);
        cellStyle(one, row, column, rows, columns, child.sticky);
        element.append(one);
        column += columns - 1;
    }
    const flexible = [options.flexible_columns ?? []].flat();
    element.style.gridTemplateColumns =
        Array.from({length: most}, (_, i) => flexible.includes(i + 1) ? '1fr' : 'auto').join(' ');
    return element;
}

function tabs(node, pins, path) {
    const names = node.options?.names ?? [],
          pages = node.children.map((child, i) => build(child, pins, `${path}.${i}`));
    const buttons = pages.map(
        (page, i) =>
            h('button', {
                role: 'tab',
                onclick: () => choose(i),
                onkeydown: event => {
                    const to = {ArrowRight: i + 1, ArrowLeft: i - 1}[event.key];
                    if (to === undefined || !buttons[to]) return;
                    choose(to);
                    buttons[to].focus();
                }
            },
              String(names[i] ?? i + 1)));
    const choose = index => pages.forEach((page, i) => {
        page.hidden = i !== index;
        buttons[i].setAttribute('aria-selected', String(i === index));
        buttons[i].setAttribute('aria-pressed', String(i === index));
        buttons[i].tabIndex = i === index ? 0 : -1;
    });
    pages.forEach(page => page.setAttribute('role', 'tabpanel'));
    choose(0);
    return h(
        'div', {class: 'w-box w-vbox'}, h('div', {class: 'bar', role: 'tablist'}, buttons), pages);
}

function build(node, pins, path) {
    const make =
        {vbox: container, hbox: container, labelframe: container, table, tabs}[node.widget] ??
        makers[node.widget];
    const element = make(node, pins, path);
    element.dataset.widget = node.widget;
    if (node.pin) element.dataset.pin = node.pin;
    applyStyle(element, node.options ?? {}, node.widget);
    return element;
}

export function show(main) {
    const panel = state.panel;
    if (!panel) {
        main.append(h('p', {}, 'No user panel is loaded. Start with: hal panel FILE.panel'));
        return null;
    }
    const pins = new Pins(panel), note = h('p', {class: 'dim', role: 'status'});
    const root = build(panel.root, pins, 'p');
    root.classList.add('w-root');
    root.classList.toggle('w-pyvcp', Boolean(panel.root.pyvcp));
    main.append(panel.root.title ? h('h2', {}, panel.root.title) : '', note, root);
    const ends = [
        on('panel',
           event => {
               for (const [name, value] of Object.entries(event.values))
                   if (pins.value(name) !== value) pins.set(name, value);
               pins.ready = event.ready;
               enable();
           }),
        on('state', () => enable())
    ];
    // Values of the machine that are shown without a pin.
    const names = [...pins.sources.keys()];
    if (names.length > 0)
        ends.push(subscribe(
            names, 100,
            values =>
                names.forEach((name, i) => pins.sources.get(name).forEach(act => act(values[i])))));
    function enable() {
        for (const element of root.querySelectorAll('[data-output]')) {
            if ('disabled' in element) element.disabled = !state.held;
            element.setAttribute('aria-disabled', String(!state.held));
        }
        text(
            note,
            state.held       ? '' :
                !state.write ? 'Read-only: restart hal panel with --write to operate this panel.' :
                state.token  ? 'Take control to operate this panel.' :
                               'Read-only: open the address with the token.');
    }
    enable();
    // The server sets the safe values when these messages stop.
    const beat = setInterval(() => {
        if (state.held) tell({panel: {}});
    }, Math.max(50, panel.timeout_ms / 4));
    const release = event => {
        if (event.type === 'blur' || document.hidden) pins.release.forEach(act => act());
    };
    document.addEventListener('visibilitychange', release);
    addEventListener('blur', release);
    return () => {
        pins.release.forEach(act => act());
        clearInterval(beat);
        document.removeEventListener('visibilitychange', release);
        removeEventListener('blur', release);
        ends.forEach(end => end());
        pins.ends.forEach(end => end());
    };
}
