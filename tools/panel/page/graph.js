// SPDX-License-Identifier: MIT
// The netlist as a drawing with live values: search, neighbourhood, groups; a click on a pin shows
// its writer and readers.
import {on, request, subscribe} from './link.js';
import {h, number, text} from './dom.js';
import {build, firstBoxes, neighbourhood} from './graph_model.js';
import {GraphCanvas, textMeasure} from './graph_canvas.js';
import {objects} from './objects.js';
import {layered} from './layout.js';
import {remember} from './place.js';

const maxBoxes = 400, maxValues = 1000, maxSuggestions = 2000;

/// What `show latency` states about a pin, without the pin.
const latencyOf = (found, pin) =>
    found ? found.slice(found.indexOf(pin) + pin.length).replace(/^[\s:,]+/, '') : '';

/** The view of the netlist. */
export class View {
    /**
     * @param {HTMLElement} main
     * @param {URLSearchParams} query
     */
    constructor(main, query) {
        this.all = new Map();
        this.open = true;
        this.selected = query.get('pin') ?? '';
        this.collapsed = new Set((query.get('collapsed') ?? '').split(',').filter(name => name));
        this.stopFollowing = () => {};
        this.widthOf = textMeasure();
        this.makeControls(query);
        const canvas = h('canvas', {
            tabindex: 0,
            role: 'img',
            'aria-label': 'Drawing of the netlist. Use the search to read a pin with its writer ' +
                'and readers. Arrow keys move, plus and minus zoom, 0 shows everything.'
        });
        this.details =
            h('div', {class: 'floating', hidden: true, role: 'region', 'aria-label': 'Details'});
        this.note = h('span', {class: 'dim'});
        const all = h('button', {onclick: () => this.drawing.fit()}, 'Show all');
        main.append(
            h('div', {class: 'column'},
              h('div', {class: 'bar'}, this.search, this.names, this.depth, this.grouped, all,
                this.note),
              h('div', {class: 'fill'}, canvas, this.details)));
        this.drawing = new GraphCanvas(
            canvas, {select: name => this.select(name), fold: name => this.fold(name)});
        this.load();
        this.unsubscribe = on('machine', () => this.load());
    }

    end() {
        this.open = false;
        this.unsubscribe();
        this.stopFollowing();
        this.drawing.end();
    }

    makeControls(query) {
        this.search = h('input', {
            type: 'search',
            class: 'grow',
            list: 'graph-names',
            placeholder: 'Search pins, signals, instances',
            'aria-label': 'Search',
            value: query.get('around') ?? '',
            onchange: () => this.find(this.search.value)
        });
        this.names = h('datalist', {id: 'graph-names'});
        const depths = [
            ['', 'whole netlist'], ['1', '1 step around'], ['2', '2 steps around'],
            ['3', '3 steps around']
        ];
        this.depth = h(
            'select', {
                'aria-label': 'Depth',
                onchange: () => {
                    remember({depth: this.depth.value});
                    this.arrange();
                }
            },
            depths.map(([value, label]) => h('option', {value}, label)));
        this.depth.value = query.get('depth') ?? '';
        this.grouped =
            h('button', {
                'aria-pressed': query.get('group') ? 'true' : 'false',
                onclick: () => this.toggleGroups()
            },
              'Group by component');
    }

    isGrouped() { return this.grouped.getAttribute('aria-pressed') === 'true'; }

    toggleGroups() {
        this.grouped.setAttribute('aria-pressed', String(!this.isGrouped()));
        remember({group: this.isGrouped() ? '1' : ''});
        this.arrange();
    }

    async load() {
        this.all = await objects(true);
        if (!this.open) return;
        this.arrange();
        this.suggest();
        if (this.selected !== '') this.select(this.selected, !this.drawing.view.fitted);
    }

    suggest() {
        const linked = [...this.all.values()].filter(one => one.kind === 'sig' || one.signal);
        const names =
            new Set([...this.drawing.graph.boxes.map(one => one.id), ...linked.map(o => o.name)]);
        this.names.replaceChildren(
            ...[...names].slice(0, maxSuggestions).map(value => h('option', {value})));
    }

    /// Lays out what is to be shown.
    arrange() {
        let graph = build(
            this.all, {grouped: this.isGrouped(), collapsed: this.collapsed}, this.widthOf);
        const whole = graph.boxes.length, {depth, search} = this;
        if (depth.value !== '' && search.value !== '')
            graph = neighbourhood(graph, search.value, Number(depth.value));
        graph = firstBoxes(graph, maxBoxes);
        const size = layered(graph.boxes, graph.edges);
        text(this.note, `${graph.boxes.length} of ${whole} boxes, ${graph.edges.length} links`);
        this.drawing.canvas.dataset.boxes = String(graph.boxes.length);
        this.drawing.show(graph, size);
        this.follow();
    }

    follow() {
        this.stopFollowing();
        this.stopFollowing = () => {};
        const {graph, values, canvas} = this.drawing;
        const signals =
            new Set(graph.boxes.flatMap(box => box.outputs.map(pin => pin.signal)));
        const shown = [...signals].slice(0, maxValues);
        if (shown.length === 0) return;
        this.stopFollowing = subscribe(shown, 200, got => {
            shown.forEach((name, i) => values.set(name, got[i]));
            canvas.dataset.values = String(values.size);
            this.drawing.request();
            const live = /** @type {HTMLElement} */ (this.details.querySelector('[data-live]'));
            if (live) text(live, number(values.get(live.dataset.live)));
        }, true);
    }

    find(name) {
        remember({around: name});
        if (this.depth.value !== '') this.arrange();
        const known =
            this.all.has(name) || this.drawing.graph.boxes.some(one => one.id === name);
        if (known) return this.select(name, true);
        const found = [...this.all.keys()].find(other => other.includes(name));
        if (found && name !== '') this.select(found, true);
    }

    fold(name) {
        if (!this.collapsed.delete(name)) this.collapsed.add(name);
        remember({collapsed: [...this.collapsed].join(',')});
        const place = {...this.drawing.view};
        this.arrange();
        Object.assign(this.drawing.view, place);
        this.select(name);
    }

    /// Marks a pin, a signal or a box, and shows its details; '' nothing.
    async select(name, move = false) {
        const object = this.all.get(name),
              signal = object?.kind === 'sig' ? object : this.all.get(object?.signal);
        this.selected = name;
        remember({pin: name});
        Object.assign(this.drawing, {selected: name, signal: signal?.name ?? ''});
        this.drawing.request();
        this.details.hidden = name === '';
        if (name === '') return;
        if (move) this.drawing.centre(name);
        const content = [
            h('button', {'aria-label': 'close', onclick: () => this.select('')}, '×'),
            h('h2', {class: 'mono'}, name)
        ];
        if (object) content.push(...this.describe(object));
        if (signal)
            content.push(...await this.describeSignal(signal));
        else if (object)
            content.push(h('p', {class: 'dim'}, 'not linked'));
        const box = this.drawing.graph.boxes.find(one => one.id === name);
        if (box) content.push(...this.describeBox(box));
        if (this.selected === name) this.details.replaceChildren(...content);
    }

    describe({type, dir, unit, doc}) {
        return [
            h('p', {}, `${type} ${dir ?? 'signal'}${unit ? `, ${unit}` : ''}`),
            doc ? h('p', {class: 'dim'}, doc) : ''
        ];
    }

    async describeSignal(signal) {
        const value = this.drawing.values.get(signal.name) ?? signal.value;
        const reply = await request({run: ['show', 'latency']});
        const lines = reply.ok ?
            reply.out.split('\n').filter(
                l => signal.pins.some(pin => l.includes(` ${pin}`) || l.startsWith(pin)) &&
                    l.includes(signal.name)) :
            [];
        const readers = signal.pins.filter(pin => pin !== signal.writer).map(pin => {
            const found = lines.find(l => l.includes(pin));
            return h(
                'li', {},
                h('button', {class: 'mono', onclick: () => this.select(pin, true)}, pin),
                h('div', {class: 'dim'}, latencyOf(found, pin)));
        });
        if (readers.length === 0) readers.push(h('li', {class: 'dim'}, 'none'));
        return [
            h('p', {}, 'value ',
              h('b', {class: 'mono', 'data-live': signal.name}, number(value))),
            h('p', {}, `signal ${signal.name}`),
            h('p', {},
              signal.writer ? `written by ${signal.writer}` : 'no writer: sets sets it'),
            h('h2', {}, 'Readers'), h('ul', {class: 'plain'}, readers)
        ];
    }

    describeBox(box) {
        const threads = [...box.threads].join(', ');
        return [
            h('p', {class: 'dim'}, threads ? `runs in ${threads}` : ''),
            h('button', {onclick: () => this.fold(box.id)}, box.collapsed ? 'Expand' : 'Collapse')
        ];
    }
}
