// SPDX-License-Identifier: MIT
// What happened: writes and connections of this server, faults, edits and commands of the machine.
import {on, request, state} from './link.js';
import {h} from './dom.js';
import {remember} from './place.js';

const kinds = ['fault', 'write', 'edit', 'command', 'message', 'client', 'panel', 'machine'];

export function show(main, query) {
    const hidden = new Set((query.get('hide') ?? '').split(',').filter(kind => kind)),
          list = h('ul', {class: 'plain log', id: 'log'});
    const filter = h('input', {
        type: 'search',
        class: 'grow',
        placeholder: 'Filter',
        'aria-label': 'Filter',
        value: query.get('filter') ?? ''
    });
    const buttons = kinds.map(
        kind =>
            h('button', {
                'aria-pressed': String(!hidden.has(kind)),
                onclick: event => {
                    if (!hidden.delete(kind)) hidden.add(kind);
                    event.currentTarget.setAttribute('aria-pressed', String(!hidden.has(kind)));
                    remember({hide: [...hidden].join(',')});
                    draw();
                }
            },
              kind));
    main.append(
        h('div', {class: 'bar'}, filter,
          h('span', {class: 'bar tight', role: 'group', 'aria-label': 'Kinds to show'}, buttons)),
        h('div', {class: 'card'}, list));
    let faults = [];
    function draw() {
        const word = filter.value.toLowerCase();
        const all =
            [...state.log.filter(one => one.kind !== 'fault' || faults.length === 0), ...faults]
                .filter(one => !hidden.has(one.kind) && one.text.toLowerCase().includes(word))
                .sort((a, b) => b.unix_ms - a.unix_ms)
                .slice(0, 500);
        list.replaceChildren(...(
            all.length === 0 ?
                [h('li', {class: 'dim'}, 'Nothing happened since this page was opened.')] :
                all.map(
                    one => h(
                        'li', {class: one.kind === 'fault' ? 'bad' : ''},
                        h('time', {},
                          new Date(one.unix_ms).toLocaleTimeString([], {hour12: false})),
                        h('span', {class: 'dim kind'}, `${one.kind} `), h('span', {}, one.text)))));
    }
    async function readFaults() {
        const reply = await request({run: ['show', 'fault']});
        if (!reply.ok) return;
        try {
            faults = JSON.parse(reply.out).map(
                row => ({
                    kind: 'fault',
                    unix_ms: Date.now() - row.age_ns / 1e6,
                    text: row.sentence + (row.count > 1 ? ` (${row.count} times)` : '')
                }));
        } catch {
            faults = [];
        }
        draw();
    }
    filter.addEventListener('input', () => {
        remember({filter: filter.value});
        draw();
    });
    draw();
    readFaults();
    const timer = setInterval(readFaults, 2000), ends = [on('logged', draw)];
    return () => {
        clearInterval(timer);
        ends.forEach(end => end());
    };
}
