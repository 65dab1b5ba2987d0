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

/// The result of a boot, CiA 302-2: 0 not finished, 1 booted, else a letter, A to O.
function bootResult(value, names) {
    const firstLetter = 65;
    if (value >= firstLetter) return `failed (${String.fromCharCode(value)})`;
    return names.get(value) ?? String(value);
}

/// The title of a column.
const titleOf = what => what.replace(/-ms$/, '').replaceAll('-', ' ');

/// The words for a value of a pin.
function wordsFor(name, value, names, unit) {
    if (value === 'inf') return '–';  // an age without a sign of life
    if (name === 'boot-result') return bootResult(value, names);
    if (name === 'emcy' || name === 'error-code') return emergency(value);
    if (name === 'error-register') return register(value);
    if (names.size > 1 && typeof value === 'number') return names.get(value) ?? String(value);
    if (typeof value === 'boolean') return value ? 'yes' : 'no';
    const shortened = typeof value === 'number' ? Number(value.toPrecision(5)) : value;
    return `${number(shortened)}${unit ? ` ${unit}` : ''}`;
}

/// The buses of the machine by their instances: their own pins, and those of their stations.
function busesIn(all) {
    const found = new Map();
    for (const pin of all.values()) {
        if (pin.kind !== 'pin' || !buses[pin.component] || !pin.instance) continue;
        if (!found.has(pin.instance))
            found.set(
                pin.instance, {kind: buses[pin.component], own: new Map(), nodes: new Map()});
        const prefix = pin.instance + '.',
              rest = pin.name.startsWith(prefix) ? pin.name.slice(prefix.length) : pin.name;
        if (!rest.includes('.')) found.get(pin.instance).own.set(rest, pin);
    }
    for (const [instance, bus] of found)
        for (const name of all.keys()) {
            if (!name.startsWith(instance + '.') || !name.endsWith('.online')) continue;
            const node = name.slice(instance.length + 1, -'.online'.length);
            const pins = new Map();
            for (const what of shown) {
                const pin = all.get(`${instance}.${node}.${what}`);
                if (pin) pins.set(what, pin);
            }
            bus.nodes.set(node, pins);
        }
    return found;
}

/** The mark of a station on the line of its bus. */
class Chip {
    constructor(node, pins) {
        this.element = h('span', {class: 'station'}, node);
        this.pins = pins;
        this.causes = new Set();
    }

    /// Shows a value, in its cell too.
    paint(what, value, cell) {
        const on = Boolean(value), marks = this.element.classList;
        if (what === 'online') {
            marks.toggle('online', on);
            if (!this.pins.has('operational')) marks.toggle('operational', on);
            cell.className = on ? 'n good' : 'n bad';
        }
        if (what === 'operational') marks.toggle('operational', on);
        if (what === 'fault' || what === 'emcy') {
            this.causes[on ? 'add' : 'delete'](what);
            marks.toggle('faulty', this.causes.size > 0);
            cell.classList.toggle('bad', on);
        }
    }
}

/** The view of buses. */
export class View {
    /**
     * @param {HTMLElement} main
     * @param {URLSearchParams} query
     */
    constructor(main, query) {
        this.content = h('div', {class: 'cards'});
        this.wanted = query.get('bus') ?? '';
        this.open = true;
        this.stopFollowing = () => {};
        /** @type {{name: string, act: (value: any) => void}[]} */
        this.watched = [];
        main.append(this.content);
        this.load();
        this.unsubscribe = on('machine', () => this.load());
    }

    end() {
        this.open = false;
        this.unsubscribe();
        this.stopFollowing();
    }

    async load() {
        const found = busesIn(await objects(true));
        if (this.open) this.draw(found);
    }

    draw(found) {
        this.watched = [];
        this.content.replaceChildren(
            ...[...found].map(([instance, bus]) => this.busCard(instance, bus)));
        if (found.size === 0)
            this.content.append(
                h('p', {class: 'dim'},
                  'This machine has no CANopen, TDMA or EtherCAT component.'));
        this.follow();
    }

    follow() {
        this.stopFollowing();
        this.stopFollowing = () => {};
        const watched = this.watched;
        if (watched.length === 0) return;
        this.stopFollowing =
            subscribe(watched.map(({name}) => name), 250, values => values.forEach((value, i) => {
                if (value !== null) watched[i].act(value);
            }));
    }

    /// Makes the cell of a pin, which follows its value.
    cell(pin, paint = null) {
        const cell = h('td', {class: 'n'}, '–');
        if (!pin || this.watched.length >= most) return cell;
        const name = pin.name.split('.').pop(),
              names = /(state|step|result)$/.test(name) ? meanings(pin.doc) : new Map();
        this.watched.push({
            name: pin.name,
            act: value => {
                text(cell, wordsFor(name, value, names, pin.unit));
                paint?.(value, cell);
            }
        });
        return cell;
    }

    busCard(instance, bus) {
        const line =
            h('div', {
                class: 'bus',
                role: 'img',
                'aria-label': `stations of ${instance}; the table has their states`
            },
              h('span', {class: 'station master'}, instance));
        return h(
            'section', {class: 'card wide', id: `bus-${instance}`},
            h('h2', {}, `${bus.kind} ${instance}`), line, this.stations(bus, line),
            this.busItself(instance, bus));
    }

    /// Makes the table of the stations, and puts their marks on the line.
    stations(bus, line) {
        if (bus.nodes.size === 0) return h('p', {class: 'dim'}, 'no stations');
        const columns = shown.filter(what => [...bus.nodes.values()].some(pins => pins.has(what)));
        const rows = [...bus.nodes].map(([node, pins]) => {
            const chip = new Chip(node, pins);
            line.append(chip.element);
            const cells = columns.map(what => {
                const cell =
                    this.cell(pins.get(what), (value, to) => chip.paint(what, value, to));
                cell.dataset.title = titleOf(what);  // shown on a narrow screen
                return cell;
            });
            return h('tr', {'data-node': node}, h('td', {class: 'mono'}, node), cells);
        });
        const titles =
            columns.map(what => h('th', {class: 'n', 'data-what': what}, titleOf(what)));
        const head = h('thead', {}, h('tr', {}, h('th', {}, 'Station'), titles));
        return h(
            'div', {class: 'scroll'},
            h('table', {class: 'stations'}, head, h('tbody', {}, rows)));
    }

    /// Makes the list of the bus's own outputs.
    busItself(instance, bus) {
        const rows =
            [...bus.own]
                .filter(
                    ([, pin]) => pin.dir === 'OUT' && !/(^|[.-])(time|tmax)$/.test(pin.name))
                .map(
                    ([name, pin]) =>
                        h('tr', {title: pin.doc ?? ''}, h('td', {}, name), this.cell(pin)));
        return h(
            'details', {
                open: this.wanted === instance,
                ontoggle: event => remember({bus: event.target.open ? instance : ''})
            },
            h('summary', {}, 'The bus itself'),
            h('table', {class: 'narrow'}, h('tbody', {}, rows)));
    }
}
