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

/// The value that was typed, for the protocol; undefined when it is invalid.
function typed(type, word) {
    if (type === 'bit')
        return /^(1|true)$/i.test(word) ? true : /^(0|false)$/i.test(word) ? false : undefined;
    const value = Number(word);
    return word.trim() === '' || !Number.isFinite(value) ||
            (type !== 'float' && !Number.isInteger(value)) ?
        undefined :
        value;
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

function setter(name, object) {
    if (!settable(object))
        return object.kind === 'sig' ?
            h('span', {class: 'dim hide-narrow'}, `set by ${object.writer}`) :
            object.signal ? h('span', {class: 'dim hide-narrow'}, `linked to ${object.signal}`) :
                            h('span', {class: 'dim hide-narrow'}, 'output');
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

export function show(main, query) {
    let names = (query.get('names') ?? '').split(',').filter(name => name), all = new Map(),
        rows = new Map(), end = null, open = true;
    const filter = h('input', {
        type: 'search',
        class: 'grow',
        placeholder: 'Filter names',
        'aria-label': 'Filter names',
        value: query.get('filter') ?? ''
    });
    const tree = h('div', {class: 'card tree'}), body = h('tbody'), note = h('p', {class: 'dim'});
    const table =
        h('table', {},
          h('thead', {},
            h('tr', {}, h('th', {}, 'Name'), h('th', {class: 'n'}, 'Value'), h('th', {}, 'Unit'),
              h('th', {class: 'hide-narrow'}, 'Last 15 s'), h('th', {}, 'Set'),
              h('th', {}, h('span', {class: 'unseen'}, 'Remove')))),
          body);
    main.append(
        h('div', {class: 'split'},
          h('div', {class: 'column'}, h('div', {class: 'bar'}, filter), tree),
          h('div', {class: 'card'}, h('h2', {}, 'Watch list'), note,
            h('p', {id: 'watch-problem', class: 'bad', role: 'status'}),
            h('div', {class: 'scroll'}, table))));

    function leaf(name, label = name) {
        const object = all.get(name);
        return h(
            'button', {
                class: 'leaf',
                title: `${object.type} ${object.dir ?? object.kind}${
                    object.doc ? ': ' + object.doc : ''}`,
                onclick: () => add(name)
            },
            label);
    }
    function branch(path, list) {
        const groups = new Map();
        for (const name of list) {
            const rest = name.slice(path.length), dot = rest.indexOf('.');
            const key = dot < 0 ? rest : rest.slice(0, dot + 1);
            if (!groups.has(key)) groups.set(key, []);
            groups.get(key).push(name);
        }
        return [...groups].map(([key, inside]) => {
            if (inside.length === 1) return leaf(inside[0], inside[0].slice(path.length));
            const details =
                h('details', {},
                  h('summary', {}, `${key.replace(/\.$/, '')} `,
                    h('span', {class: 'dim'}, String(inside.length))));
            details.addEventListener('toggle', () => {
                if (details.open && details.children.length === 1)
                    details.append(...branch(path + key, inside));
            });
            return details;
        });
    }
    function drawTree() {
        const word = filter.value.trim().toLowerCase(), sorted = [...all.keys()].sort();
        if (word !== '') {
            const found = sorted.filter(name => name.toLowerCase().includes(word));
            tree.replaceChildren(
                ...found.slice(0, 400).map(name => leaf(name)),
                found.length > 400 ?
                    h('p', {class: 'dim'}, `${found.length - 400} more; type more letters`) :
                    '',
                found.length === 0 ? h('p', {class: 'dim'}, 'No name contains this.') : '');
            return;
        }
        const part = (title, kind, open) => {
            const list = sorted.filter(name => all.get(name).kind === kind);
            const details =
                h('details', {open},
                  h('summary', {}, `${title} `, h('span', {class: 'dim'}, String(list.length))));
            details.append(...branch('', list));
            return details;
        };
        tree.replaceChildren(
            part('Signals', 'sig', true), part('Pins', 'pin', true),
            part('Parameters', 'param', false));
    }
    function drawRows() {
        rows.forEach(row => row.surface.end());
        rows = new Map();
        body.replaceChildren(...names.map(name => {
            const object = all.get(name),
                  canvas =
                      h('canvas', {class: 'spark', role: 'img', 'aria-label': `values of ${name}`}),
                  value = h('td', {class: 'n mono', 'data-value': name}, '–');
            const row = {name, value, values: [], canvas};
            row.surface = surface(
                canvas, (context, width, height) => sparkline(context, width, height, row.values));
            rows.set(name, row);
            return h(
                'tr', {},
                h('td', {class: 'mono', title: object?.doc ?? ''}, name,
                  object ? h('span', {class: 'dim hide-narrow'}, ` ${object.type}`) : ''),
                value, h('td', {class: 'dim'}, object?.unit ?? ''),
                h('td', {class: 'hide-narrow'}, canvas),
                h('td', {},
                  object ? setter(name, object) : h('span', {class: 'dim'}, 'unknown name')),
                h('td', {},
                  h('button', {
                      class: 'plain',
                      'aria-label': `remove ${name}`,
                      onclick: () => change(names.filter(other => other !== name))
                  },
                    '×')));
        }));
        text(
            note,
            names.length === 0 ?
                'Choose names in the tree. The list is part of the address of this page.' :
                '');
        enable();
    }
    function enable() {
        for (const element of body.querySelectorAll('.set'))
            element.disabled = !state.held;
    }
    function follow() {
        if (end) end();
        end =
            names.length === 0 ? null : subscribe(names, 100, values => names.forEach((name, i) => {
                const row = rows.get(name), value = values[i];
                if (!row) return;
                if (typeof value === 'boolean') {
                    if (row.lamp !== value)
                        row.value.replaceChildren(
                            h('span', {class: value ? 'lamp on' : 'lamp'}), ` ${number(value)}`);
                    row.lamp = value;
                } else
                    text(row.value, number(value));
                row.values.push(value);
                if (row.values.length > history) row.values.shift();
                row.surface.request();
            }));
    }
    function change(to) {
        names = to;
        remember({names: names.join(',')});
        drawRows();
        follow();
    }
    function add(name) {
        if (!names.includes(name)) change([...names, name]);
    }

    filter.addEventListener('input', () => {
        drawTree();
        remember({filter: filter.value});
    });
    const load = async () => {
        all = await objects(true);
        if (!open) return;
        drawTree();
        drawRows();
    };
    load();
    follow();
    const ends = [on('machine', load), on('state', enable)];
    return () => {
        open = false;
        ends.forEach(one => one());
        if (end) end();
        rows.forEach(row => row.surface.end());
    };
}
