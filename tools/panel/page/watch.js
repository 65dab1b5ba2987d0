// SPDX-License-Identifier: MIT
// A tree of all names, watch lists, set.
import {isLive, on, request, state, subscribe} from './link.js';
import {announce, colour, h, number, surface, text} from './dom.js';
import {compareNames} from './names.js';
import {objects, settable} from './objects.js';
import {remember} from './place.js';
import {rangeOf, typedValue} from './typed_value.js';
import {keep, lists} from './watch_lists.js';

const history = 150, period = 100;  // values of a sparkline, ms between two: 15 s

/// Draws values; null is a time without a value of a running machine, which is shaded.
function sparkline(context, width, height, values) {
    const numbers = values.filter(value => value !== null).map(Number).filter(Number.isFinite);
    const across = i => width * (i + history - values.length) / (history - 1);
    context.fillStyle = colour('--line');
    values.forEach((value, i) => {
        if (value === null) context.fillRect(across(i - 1), 0, across(i) - across(i - 1), height);
    });
    if (numbers.length < 2) return;
    let low = Math.min(...numbers), high = Math.max(...numbers);
    if (low === high) {
        low -= 1;
        high += 1;
    }
    context.strokeStyle = colour('--accent');
    context.beginPath();
    values.forEach((value, i) => {
        if (value === null) return;
        const y = height - 2 - (height - 4) * (Number(value) - low) / (high - low);
        if (i === 0 || values[i - 1] === null)
            context.moveTo(across(i), y);
        else
            context.lineTo(across(i), y);
    });
    context.stroke();
}

/// The line of an error that names its cause.
function causeOf(error) {
    return error.split('\n').find(line => /error|read-only|lost|running/.test(line)) ?? error;
}

/// Why a value cannot be set here.
function setElsewhere({kind, writer, signal}) {
    if (kind === 'sig') return `set by ${writer}`;
    return signal ? `linked to ${signal}` : 'output';
}

/// The elements that set a value: set(value) for a valid one, reject(problem) for any other text.
function setter(name, object, set, reject) {
    if (!settable(object)) return h('span', {class: 'dim hide-narrow'}, setElsewhere(object));
    if (object.type === 'bit')
        return h(
            'span', {class: 'setter'},
            ['TRUE', 'FALSE'].map(
                word =>
                    h('button', {
                        class: 'set',
                        'aria-label': `set ${name} ${word}`,
                        onclick: () => set(word === 'TRUE')
                    },
                      word)));
    const unit = object.unit ? ` in ${object.unit}` : '', range = rangeOf(object.type);
    const input = h('input', {
        class: 'set',
        size: 9,
        inputmode: 'decimal',
        title: range ? `${object.type}: ${range}` : object.type,
        'aria-label': `new value of ${name}${unit}`
    });
    const send = () => {
        const {value, problem} = typedValue(object.type, input.value);
        input.toggleAttribute('aria-invalid', false);
        if (problem) {
            input.setAttribute('aria-invalid', 'true');
            reject(`${name}: ${problem}`);
        } else
            set(value);
    };
    input.addEventListener('keydown', event => {
        if (event.key === 'Enter') send();
    });
    return h(
        'span', {class: 'setter'}, input, object.unit ? h('span', {class: 'dim'}, object.unit) : '',
        h('button', {class: 'set', onclick: send}, 'Set'));
}

/// Groups names by the part behind `path`, up to the next dot.
function grouped(path, list) {
    const groups = new Map();
    for (const name of list) {
        const rest = name.slice(path.length), dot = rest.indexOf('.');
        const key = dot < 0 ? rest : rest.slice(0, dot + 1);
        if (!groups.has(key)) groups.set(key, []);
        groups.get(key).push(name);
    }
    return groups;
}

/** A row of the watch list: its value and the last 15 s of it. */
class Row {
    constructor(name) {
        this.values = [];
        this.lamp = undefined;
        this.value = h('td', {class: 'n mono', 'data-value': name}, '–');
        this.canvas = h('canvas', {class: 'spark', role: 'img', 'aria-label': `values of ${name}`});
        this.surface = surface(
            this.canvas,
            (context, width, height) => sparkline(context, width, height, this.values));
    }

    end() { this.surface.end(); }

    update(value) {
        if (typeof value === 'boolean')
            this.showLamp(value);
        else
            text(this.value, number(value));
        if (isLive()) this.keep(value ?? null);
    }

    /// Adds a value to the last 15 s; null: the machine does not run.
    keep(value) {
        this.values.push(value);
        if (this.values.length > history) this.values.shift();
        this.surface.request();
    }

    showLamp(value) {
        if (this.lamp !== value)
            this.value.replaceChildren(
                h('span', {class: value ? 'lamp on' : 'lamp'}), ` ${number(value)}`);
        this.lamp = value;
    }
}

/** The view of watch lists: a tree of all names, and the names that were chosen. */
export class View {
    /**
     * @param {HTMLElement} main
     * @param {URLSearchParams} query
     */
    constructor(main, query) {
        this.names = (query.get('names') ?? '').split(',').filter(name => name);
        this.all = new Map();
        /** @type {Map<string, Row>} */
        this.rows = new Map();
        this.open = true;
        this.stopFollowing = () => {};
        this.filter = h('input', {
            type: 'search',
            class: 'grow',
            placeholder: 'Filter names',
            'aria-label': 'Filter names',
            value: query.get('filter') ?? '',
            oninput: () => {
                this.drawTree();
                remember({filter: this.filter.value});
            }
        });
        this.tree = h('div', {class: 'card tree'});
        this.body = h('tbody');
        this.note = h('p', {class: 'dim'});
        this.problem = h('p', {id: 'watch-problem', class: 'bad', role: 'status'});
        /** @type {{name: string, value: any} | null} */
        this.before = null;  // what undo sets
        this.undoButton = h('button', {id: 'undo', hidden: true, onclick: () => this.undo()});
        this.makeLists();
        const titles = [
            h('th', {}, 'Name'), h('th', {class: 'n'}, 'Value'), h('th', {}, 'Unit'),
            h('th', {class: 'hide-narrow live'}, 'Last 15 s'), h('th', {class: 'live'}, 'Set'),
            h('th', {}, h('span', {class: 'unseen'}, 'Remove'))
        ];
        const table = h('table', {class: 'watch'}, h('thead', {}, h('tr', {}, titles)), this.body);
        main.append(
            h('div', {class: 'split'},
              h('div', {class: 'column'}, h('div', {class: 'bar'}, this.filter), this.tree),
              h('div', {class: 'card'}, h('h2', {}, 'Watch list'),
                h('div', {class: 'bar'}, this.chosen, this.title, this.keepButton,
                  this.removeButton, this.undoButton),
                this.note, this.problem, h('div', {class: 'scroll'}, table))));
        this.load();
        this.pausing = setInterval(() => this.notePause(), period);
        this.subscriptions = [on('machine', () => this.load()), on('state', () => this.enable())];
    }

    end() {
        this.open = false;
        clearInterval(this.pausing);
        this.subscriptions.forEach(unsubscribe => unsubscribe());
        this.stopFollowing();
        this.rows.forEach(row => row.end());
    }

    // ---- lists by name

    makeLists() {
        this.chosen = h('select', {
            'aria-label': 'Saved watch list',
            onchange: () => {
                this.title.value = this.chosen.value;
                const names = lists(localStorage).get(this.chosen.value);
                if (names) this.change(names);
                this.drawLists();
            }
        });
        this.title = h('input', {
            size: 14,
            placeholder: 'Name of the list',
            'aria-label': 'Name of the list',
            oninput: () => this.drawLists()
        });
        this.keepButton = h('button', {onclick: () => this.keepList(this.names)}, 'Save list');
        this.removeButton = h('button', {onclick: () => this.keepList([])}, 'Delete list');
        this.drawLists();
    }

    drawLists() {
        const title = this.title.value.trim(), saved = [...lists(localStorage).keys()];
        const none = saved.length === 0 ? 'no saved list' : 'choose a saved list';
        this.chosen.replaceChildren(
            h('option', {value: ''}, none), ...saved.map(name => h('option', {value: name}, name)));
        this.chosen.value = saved.includes(title) ? title : '';
        this.chosen.disabled = saved.length === 0;
        this.keepButton.disabled = title === '' || this.names.length === 0;
        this.removeButton.hidden = !saved.includes(title);
    }

    keepList(names) {
        const stored = keep(localStorage, this.title.value.trim(), names);
        this.reject(stored ? '' : 'the browser has no space for the list');
        this.drawLists();
    }

    // ---- values

    /// Shows why something was not done; an empty text removes that.
    reject(problem) {
        text(this.problem, problem);
        if (problem) announce(problem);
    }

    /// Sets a value, and keeps the one before it for undo().
    async set(name, value) {
        const old = await request({read: [name]});
        const reply = await request({set: {[name]: value}});
        if (!reply.ok) return this.reject(causeOf(reply.error));
        this.reject('');
        announce(`${name} set`);
        const before = old.ok ? old.values[0] : null;
        const type = this.all.get(name)?.type;
        const exact = before !== null &&
            (type === 'float' || typeof before !== 'number' || Number.isSafeInteger(before));
        this.before = exact ? {name, value: before} : null;
        this.drawUndo();
    }

    /// Sets the value from before the last change; once more sets the changed one again.
    undo() {
        if (this.before) this.set(this.before.name, this.before.value);
    }

    drawUndo() {
        this.undoButton.hidden = this.before === null;
        if (this.before)
            text(this.undoButton, `Undo: ${this.before.name} back to ${number(this.before.value)}`);
        this.enable();
    }

    async load() {
        this.all = await objects(true);
        if (!this.open) return;
        this.drawTree();
        this.drawRows();
        this.follow();
    }

    leaf(name, label = name) {
        const object = this.all.get(name);
        return h(
            'button', {
                class: 'leaf',
                title: `${object.type} ${object.dir ?? object.kind}${
                    object.doc ? ': ' + object.doc : ''}`,
                onclick: () => this.add(name)
            },
            label);
    }

    /// Makes the elements below `path`; what is inside a group is made when it is opened.
    branch(path, list) {
        return [...grouped(path, list)].map(([key, inside]) => {
            if (inside.length === 1) return this.leaf(inside[0], inside[0].slice(path.length));
            const details =
                h('details', {},
                  h('summary', {}, `${key.replace(/\.$/, '')} `,
                    h('span', {class: 'dim'}, String(inside.length))));
            details.addEventListener('toggle', () => {
                if (details.open && details.children.length === 1)
                    details.append(...this.branch(path + key, inside));
            });
            return details;
        });
    }

    drawTree() {
        const word = this.filter.value.trim().toLowerCase(),
              sorted = [...this.all.keys()].sort(compareNames);
        if (word !== '') return this.drawFound(sorted, word);
        const part = (title, kind, open) => {
            const list = sorted.filter(name => this.all.get(name).kind === kind);
            const details =
                h('details', {open},
                  h('summary', {}, `${title} `, h('span', {class: 'dim'}, String(list.length))));
            details.append(...this.branch('', list));
            return details;
        };
        this.tree.replaceChildren(
            part('Signals', 'sig', true), part('Pins', 'pin', true),
            part('Parameters', 'param', false));
    }

    drawFound(sorted, word) {
        const found = sorted.filter(name => name.toLowerCase().includes(word));
        this.tree.replaceChildren(...found.slice(0, 400).map(name => this.leaf(name)));
        if (found.length > 400)
            this.tree.append(
                h('p', {class: 'dim'}, `${found.length - 400} more; type more letters`));
        if (found.length === 0) this.tree.append(h('p', {class: 'dim'}, 'No name contains this.'));
    }

    drawRows() {
        this.rows.forEach(row => row.end());
        this.rows = new Map(this.names.map(name => [name, new Row(name)]));
        this.body.replaceChildren(...this.names.map(name => this.rowElement(name)));
        text(
            this.note,
            this.names.length === 0 ?
                'Choose names in the tree. The list is part of the address of this page.' :
                '');
        this.drawLists();
        this.enable();
    }

    rowElement(name) {
        const object = this.all.get(name), row = this.rows.get(name);
        const remove =
            h('button', {
                class: 'plain',
                'aria-label': `remove ${name}`,
                onclick: () => this.change(this.names.filter(other => other !== name))
            },
              '×');
        return h(
            'tr', {},
            h('td', {class: 'mono', title: object?.doc ?? ''}, name,
              object ? h('span', {class: 'dim hide-narrow'}, ` ${object.type}`) : ''),
            row.value, h('td', {class: 'dim unit'}, object?.unit ?? ''),
            h('td', {class: 'hide-narrow live'}, row.canvas),
            h('td', {class: 'set-cell live'},
              object ? setter(
                           name, object, value => this.set(name, value),
                           problem => this.reject(problem)) :
                       h('span', {class: 'dim'}, 'unknown name')),
            h('td', {}, remove));
    }

    /// What sets a value needs control.
    enable() {
        for (const element of /** @type {NodeListOf<any>} */ (this.body.querySelectorAll('.set')))
            element.disabled = !state.held;
        this.undoButton.disabled = !state.held;
    }

    follow() {
        this.stopFollowing();
        this.stopFollowing = () => {};
        const names = this.names;
        if (names.length > 0)
            this.stopFollowing = subscribe(
                names, period,
                values => names.forEach((name, i) => this.rows.get(name)?.update(values[i])));
    }

    notePause() {
        if (!isLive()) this.rows.forEach(row => row.keep(null));
    }

    change(names) {
        this.names = names;
        remember({names: names.join(',')});
        this.drawRows();
        this.follow();
    }

    add(name) {
        if (!this.names.includes(name)) this.change([...this.names, name]);
    }
}
