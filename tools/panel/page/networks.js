// SPDX-License-Identifier: MIT
// CANopen, TDMA and EtherCAT: the stations of each bus with state, errors and the last emergency in
// words, from the pins of its component.
import {on, subscribe} from './link.js';
import {h, number, text} from './dom.js';
import {objects} from './objects.js';
import {remember} from './place.js';

const buses = {
    canopen: 'CANopen',
    tdma: 'TDMA',
    ethercat: 'EtherCAT',
    lcec: 'EtherCAT'
};
const most = 3000;

/// The meanings of a number from the documentation of its pin: "0 listening, 1 synchronising, …".
function meanings(doc) {
    const found = new Map();
    for (const [, value, word] of (doc ?? '').matchAll(
             /(?:^|[\s:,;(])(\d+):? ([^,;:()\d]+?)(?=[,;)]|$)/g))
        if (!found.has(Number(value))) found.set(Number(value), word.trim());
    return found;
}

// Classes of emergency codes, CiA 301 table 26.
const emergencies = [
    [0x0000, 'no error'],
    [0x1000, 'generic error'],
    [0x2000, 'current'],
    [0x2100, 'current at the input'],
    [0x2200, 'current inside the device'],
    [0x2300, 'current at the output'],
    [0x3000, 'voltage'],
    [0x3100, 'mains voltage'],
    [0x3200, 'voltage inside the device'],
    [0x3300, 'output voltage'],
    [0x4000, 'temperature'],
    [0x4100, 'ambient temperature'],
    [0x4200, 'device temperature'],
    [0x5000, 'device hardware'],
    [0x6000, 'device software'],
    [0x6100, 'internal software'],
    [0x6200, 'user software'],
    [0x6300, 'data set'],
    [0x7000, 'additional modules'],
    [0x8000, 'monitoring'],
    [0x8100, 'communication'],
    [0x8200, 'protocol error'],
    [0x8130, 'heartbeat or life guarding'],
    [0x8140, 'recovered from bus-off'],
    [0x9000, 'external error'],
    [0xF000, 'additional functions'],
    [0xFF00, 'device specific']
];
export function emergency(code) {
    if (!code) return '–';
    const exact = emergencies.find(([value]) => value === code) ??
        emergencies.find(([value]) => value === (code & 0xFF00)) ??
        emergencies.find(([value]) => value === (code & 0xF000));
    return `${code.toString(16).toUpperCase().padStart(4, '0')}h ${exact ? exact[1] : 'unknown'}`;
}

// Bits of the error register, CiA 301 object 1001h.
const registers = [
    'generic', 'current', 'voltage', 'temperature', 'communication', 'device profile', 'reserved',
    'manufacturer'
];
const register = value => value ? registers.filter((_, bit) => value >> bit & 1).join(', ') : '–';

const shown = [
    'state', 'online', 'operational', 'emcy', 'emcy-count', 'error-register', 'fault',
    'heartbeat-age-ms', 'retries', 'boot-result', 'frames', 'late', 'drift', 'losses', 'lost-links',
    'crc-errors', 'dc-sync-diff', 'al-status-code'
];

export function show(main, query) {
    const content = h('div', {class: 'cards'}), wanted = query.get('bus') ?? '';
    main.append(content);
    let end = null, open = true;
    async function load() {
        const all = await objects(true), found = new Map();
        for (const pin of all.values()) {
            if (pin.kind !== 'pin' || !buses[pin.component] || !pin.instance) continue;
            if (!found.has(pin.instance))
                found.set(
                    pin.instance, {kind: buses[pin.component], own: new Map(), nodes: new Map()});
            const bus = found.get(pin.instance),
                  rest = pin.name.startsWith(pin.instance + '.') ?
                pin.name.slice(pin.instance.length + 1) :
                pin.name,
                  dot = rest.indexOf('.');
            if (dot < 0) bus.own.set(rest, pin);
        }
        for (const [instance, bus] of found)
            for (const name of all.keys()) {
                if (!name.startsWith(instance + '.') || !name.endsWith('.online')) continue;
                const node = name.slice(instance.length + 1, -'.online'.length), pins = new Map();
                for (const what of shown) {
                    const pin = all.get(`${instance}.${node}.${what}`);
                    if (pin) pins.set(what, pin);
                }
                bus.nodes.set(node, pins);
            }
        if (open) draw(found);
    }
    function draw(found) {
        const watched = [], act = [];
        const cell = (pin, paint) => {
            const element = h('td', {class: 'n'}, '–');
            if (!pin || watched.length >= most) return element;
            const name = pin.name.split('.').pop(),
                  names = /(state|step|result)$/.test(name) ? meanings(pin.doc) : new Map();
            watched.push(pin.name);
            act.push(value => {
                const words = name === 'emcy' || name === 'error-code' ?
                    emergency(value) :
                    name === 'error-register' ?
                    register(value) :
                    names.size > 1 && typeof value === 'number' ?
                    names.get(value) ?? String(value) :
                    typeof value === 'boolean' ?
                    value ? 'yes' : 'no' :
                    `${number(typeof value === 'number' ? Number(value.toPrecision(5)) : value)}${
                        pin.unit ? ` ${pin.unit}` : ''}`;
                text(element, words);
                paint?.(value, element);
            });
            return element;
        };
        content.replaceChildren(...(
            found.size === 0 ?
                [h('p', {class: 'dim'},
                   'This machine has no CANopen, TDMA or EtherCAT component.')] :
                [...found].map(([instance, bus]) => {
                    const columns =
                        shown.filter(what => [...bus.nodes.values()].some(pins => pins.has(what)));
                    const line =
                        h('div', {
                            class: 'bus',
                            role: 'img',
                            'aria-label': `stations of ${instance}; the table has their states`
                        },
                          h('span', {class: 'station master'}, instance));
                    const rows = [...bus.nodes].map(([node, pins]) => {
                        const chip = h('span', {class: 'station'}, node), causes = new Set();
                        line.append(chip);
                        const paint = what => (value, element) => {
                            if (what === 'online') {
                                chip.classList.toggle('online', Boolean(value));
                                if (!pins.has('operational'))
                                    chip.classList.toggle('operational', Boolean(value));
                            }
                            if (what === 'operational')
                                chip.classList.toggle('operational', Boolean(value));
                            if (what === 'fault' || what === 'emcy') {
                                causes[value ? 'add' : 'delete'](what);
                                chip.classList.toggle('faulty', causes.size > 0);
                                element.classList.toggle('bad', Boolean(value));
                            }
                            if (what === 'online') element.className = value ? 'n good' : 'n bad';
                        };
                        return h(
                            'tr', {'data-node': node}, h('td', {class: 'mono'}, node),
                            columns.map(what => cell(pins.get(what), paint(what))));
                    });
                    const own =
                        [...bus.own]
                            .filter(
                                ([, pin]) =>
                                    pin.dir === 'OUT' && !/(^|[.-])(time|tmax)$/.test(pin.name))
                            .map(
                                ([name, pin]) =>
                                    h('tr', {title: pin.doc ?? ''}, h('td', {}, name), cell(pin)));
                    return h(
                        'section', {class: 'card wide', id: `bus-${instance}`},
                        h('h2', {}, `${bus.kind} ${instance}`), line,
                        rows.length > 0 ?
                            h('div', {class: 'scroll'},
                              h('table', {},
                                h('thead', {},
                                  h('tr', {}, h('th', {}, 'Station'),
                                    columns.map(
                                        what =>
                                            h('th', {class: 'n', 'data-what': what},
                                              what.replace(/-ms$/, '').replaceAll('-', ' '))))),
                                h('tbody', {}, rows))) :
                            h('p', {class: 'dim'}, 'no stations'),
                        h('details', {
                            open: wanted === instance,
                            ontoggle: event => remember({bus: event.target.open ? instance : ''})
                        },
                          h('summary', {}, 'The bus itself'),
                          h('table', {class: 'narrow'}, h('tbody', {}, own))));
                })));
        if (end) end();
        end = watched.length === 0 ?
            null :
            subscribe(watched, 250, values => values.forEach((value, i) => {
                if (value !== null) act[i](value);
            }));
    }
    load();
    const ends = [on('machine', load)];
    return () => {
        open = false;
        ends.forEach(one => one());
        if (end) end();
    };
}
