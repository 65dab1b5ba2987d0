// SPDX-License-Identifier: MIT
// User panels: the tree of widgets from the server, with the values of its pins.
import {on, state, subscribe, tell} from './link.js';
import {h, text} from './dom.js';
import {Pins} from './panel_pins.js';
import {applyStyle, cellStyle, packStyle} from './panel_style.js';
import {makers} from './widgets.js';

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

/// What keeps this page from operating the panel; empty: nothing does.
function obstacle() {
    if (state.held) return '';
    if (!state.write)
        return `Read-only: to operate this panel, type: ${state.hal} panel --write FILE.panel`;
    if (state.token) return 'Take control to operate this panel.';
    return 'Read-only: open the address with the token.';
}

/** The view of the user panel. */
export class View {
    /** @param {HTMLElement} main */
    constructor(main) {
        const panel = state.panel;
        this.subscriptions = [];
        this.stop = () => {};
        if (!panel) {
            const load = `${state.hal} panel FILE.panel`;
            main.append(h('p', {}, `No user panel is loaded. To load one, type: ${load}`));
            return;
        }
        this.pins = new Pins(panel.pins, values => {
            if (state.held) tell({panel: {write: values}});
        }, () => state.held);
        this.note = h('p', {class: 'dim', role: 'status'});
        this.root = build(panel.root, this.pins, 'p');
        this.root.classList.add('w-root');
        this.root.classList.toggle('w-pyvcp', Boolean(panel.root.pyvcp));
        main.append(panel.root.title ? h('h2', {}, panel.root.title) : '', this.note, this.root);
        this.subscriptions = [
            on('panel', event => this.update(event)), on('state', () => this.enable()),
            ...this.followSources()
        ];
        this.enable();
        this.watchAbsence(panel.timeout_ms);
    }

    end() {
        this.pins?.releaseAll();
        this.stop();
        this.subscriptions.forEach(unsubscribe => unsubscribe());
        this.pins?.ends.forEach(end => end());
    }

    update(event) {
        for (const [name, value] of Object.entries(event.values))
            if (this.pins.value(name) !== value) this.pins.set(name, value);
        this.pins.ready = event.ready;
        this.enable();
    }

    /// Follows values of the machine that are shown without a pin.
    followSources() {
        const {sources} = this.pins, names = [...sources.keys()];
        if (names.length === 0) return [];
        const show = values =>
            names.forEach((name, i) => sources.get(name).forEach(act => act(values[i])));
        return [subscribe(names, 100, show)];
    }

    enable() {
        for (const element of
             /** @type {NodeListOf<any>} */ (this.root.querySelectorAll('[data-output]'))) {
            if ('disabled' in element) element.disabled = !state.held;
            element.setAttribute('aria-disabled', String(!state.held));
        }
        text(this.note, obstacle());
    }

    /// The server sets the safe values when the messages of this page stop; buttons are released
    /// when the page is hidden or loses the focus.
    watchAbsence(timeout_ms) {
        const beat = setInterval(() => {
            if (state.held) tell({panel: {}});
        }, Math.max(50, timeout_ms / 4));
        const release = event => {
            if (event.type === 'blur' || document.hidden) this.pins.releaseAll();
        };
        document.addEventListener('visibilitychange', release);
        addEventListener('blur', release);
        this.stop = () => {
            clearInterval(beat);
            document.removeEventListener('visibilitychange', release);
            removeEventListener('blur', release);
        };
    }
}
