// SPDX-License-Identifier: MIT
// A tree of all names, watch lists, set.
import {on, request, state, subscribe} from './link.js';
import {announce, colour, h, number, surface, text} from './dom.js';
import {objects, settable} from './objects.js';
import {remember} from './place.js';

const history = 150;  // values of a sparkline: 15 s

function sparkline(context, width, height, values) {
    const numbers = values.map(Number).filter(Number.isFinite);
    if (numbers.length < 2) return;
    let low = Math.min(...numbers), high = Math.max(...numbers);
    if (low === high) {
        low -= 1;
        high += 1;
    }
    context.strokeStyle = colour('--accent');
    context.beginPath();
    values.forEach((value, i) => {
        const x = width * (i + history - values.length) / (history - 1),
              y = height - 2 - (height - 4) * (Number(value) - low) / (high - low);
        if (i === 0)
            context.moveTo(x, y);
        else
            context.lineTo(x, y);
    });
    context.stroke();
}

const bits = {
    1: true,
    true: true,
    0: false,
    false: false
};

/// The value that was typed, for the protocol; undefined when it is invalid.
function typed(type, word) {
    if (type === 'bit') return bits[word.toLowerCase()];
    const value = Number(word);
    if (word.trim() === '' || !Number.isFinite(value)) return undefined;
    return type === 'float' || Number.isInteger(value) ? value : undefined;
}

async function set(name, value) {
    const reply = await request({set: {[name]: value}});
    const problem = reply.ok ?
        '' :
        reply.error.split('\n').filter(line => /error|read-only|lost|running/.test(line))[0] ??
            reply.error;
    announce(reply.ok ? `${name} set` : problem);
    document.getElementById('watch-problem').textContent = problem;
}

/// Why a value cannot be set here.
function setElsewhere({kind, writer, signal}) {
    if (kind === 'sig') return `set by ${writer}`;
    return signal ? `linked to ${signal}` : 'output';
}

function setter(name, object) {
    if (!settable(object)) return h('span', {class: 'dim hide-narrow'}, setElsewhere(object));
    if (object.type === 'bit')
        return h(
            'span', {class: 'setter'},
            ['TRUE', 'FALSE'].map(
                word =>
                    h('button', {
                        class: 'set',
                        'aria-label': `set ${name} ${word}`,
                        onclick: () => set(name, word === 'TRUE')
                    },
                      word)));
    const input =
        h('input',
          {class: 'set', size: 9, inputmode: 'decimal', 'aria-label': `new value of ${name}`});
    const send = () => {
        const value = typed(object.type, input.value);
        if (value === undefined)
            input.setAttribute('aria-invalid', 'true');
        else {
            input.removeAttribute('aria-invalid');
            set(name, value);
        }
    };
    input.addEventListener('keydown', event => {
        if (event.key === 'Enter') send();
    });
    return h('span', {class: 'setter'}, input, h('button', {class: 'set', onclick: send}, 'Set'));
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
        const titles = [
            h('th', {}, 'Name'), h('th', {class: 'n'}, 'Value'), h('th', {}, 'Unit'),
            h('th', {class: 'hide-narrow'}, 'Last 15 s'), h('th', {}, 'Set'),
            h('th', {}, h('span', {class: 'unseen'}, 'Remove'))
        ];
        const table = h('table', {}, h('thead', {}, h('tr', {}, titles)), this.body);
        main.append(
            h('div', {class: 'split'},
              h('div', {class: 'column'}, h('div', {class: 'bar'}, this.filter), this.tree),
              h('div', {class: 'card'}, h('h2', {}, 'Watch list'), this.note,
                h('p', {id: 'watch-problem', class: 'bad', role: 'status'}),
                h('div', {class: 'scroll'}, table))));
        this.load();
        this.follow();
        this.subscriptions =
            [on('machine', () => this.load()), on('state', () => this.enable())];
    }

    end() {
        this.open = false;
        this.subscriptions.forEach(unsubscribe => unsubscribe());
        this.stopFollowing();
        this.rows.forEach(row => row.end());
    }

    async load() {
        this.all = await objects(true);
        if (!this.open) return;
        this.drawTree();
        this.drawRows();
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
        const word = this.filter.value.trim().toLowerCase(), sorted = [...this.all.keys()].sort();
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
        if (found.length === 0)
            this.tree.append(h('p', {class: 'dim'}, 'No name contains this.'));
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
            row.value, h('td', {class: 'dim'}, object?.unit ?? ''),
            h('td', {class: 'hide-narrow'}, row.canvas),
            h('td', {},
              object ? setter(name, object) : h('span', {class: 'dim'}, 'unknown name')),
            h('td', {}, remove));
    }

    /// What sets a value needs control.
    enable() {
        for (const element of /** @type {NodeListOf<any>} */ (this.body.querySelectorAll('.set')))
            element.disabled = !state.held;
    }

    follow() {
        this.stopFollowing();
        this.stopFollowing = () => {};
        const names = this.names;
        if (names.length > 0)
            this.stopFollowing = subscribe(
                names, 100,
                values => names.forEach((name, i) => this.rows.get(name)?.update(values[i])));
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
