// SPDX-License-Identifier: MIT
// The netlist as a drawing with live values: search, neighbourhood, groups that fold; a click on a
// pin shows its writer and readers.
import {on, request, subscribe} from './link.js';
import {h, number, text} from './dom.js';
import {clustered} from './graph_clusters.js';
import {groupings, groupsOf, instanceOf, instancesOf} from './graph_groups.js';
import {
    boxOf,
    build,
    firstBoxes,
    groupId,
    groupName,
    neighbourhood,
    unlinked
} from './graph_model.js';
import {GraphCanvas, textMeasure} from './graph_canvas.js';
import {portrait} from './graph_portrait.js';
import {compareNames} from './names.js';
import {objects} from './objects.js';
import {remember} from './place.js';

const maxBoxes = 400, maxValues = 1000, maxSuggestions = 2000;
const manyInstances = 40;  // from which number on they are grouped, if nothing was chosen
const manyOnPhone = 8;
const unlinkedId = 'unlinked:';

/// A screen on which a drawing from left to right is too small to read.
const narrow = matchMedia('(max-width: 45rem) and (orientation: portrait)');

/// The names of a list in an address.
const listOf = list => new Set((list ?? '').split(',').filter(name => name));

const counted = (count, noun, plural = `${noun}s`) => `${count} ${count === 1 ? noun : plural}`;

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
        this.collapsed = listOf(query.get('collapsed'));
        this.expanded = listOf(query.get('expanded'));  // on a narrow screen, others are collapsed
        this.unfolded = listOf(query.get('open'));
        /** @type {ReturnType<typeof instancesOf>} */
        this.instances = new Map();
        /** @type {Map<string, string>} */
        this.groups = new Map();  // instance -> group
        this.unlinked = [];
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
        this.empty = h('p', {id: 'graph-empty', class: 'dim', hidden: true});
        this.unlinkedButton = h('button', {onclick: () => this.select(unlinkedId)});
        this.foldButton = h('button', {onclick: () => this.foldAll()});
        const all = h('button', {onclick: () => this.drawing.fit()}, 'Show all');
        main.append(
            h('div', {class: 'column'},
              h('div', {class: 'bar'}, this.search, this.names, this.depth, this.grouping,
                this.foldButton, all, this.unlinkedButton, this.note),
              h('div', {class: 'fill'}, canvas, this.empty, this.details)));
        this.drawing = new GraphCanvas(
            canvas, {select: name => this.select(name), fold: name => this.fold(name)});
        this.load();
        this.unsubscribe = on('machine', () => this.load());
        this.turned = () => this.arrange();
        narrow.addEventListener('change', this.turned);
    }

    end() {
        this.open = false;
        this.unsubscribe();
        narrow.removeEventListener('change', this.turned);
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
        this.grouping = h(
            'select', {'aria-label': 'Groups', onchange: () => this.group(this.grouping.value)},
            groupings.map(([value, label]) => h('option', {value}, label)));
        this.chosenGrouping = query.get('group') ?? '';
    }

    /// Groups instances in another way.
    group(grouping) {
        this.chosenGrouping = grouping;
        this.unfolded.clear();
        remember({group: grouping, open: ''});
        this.arrange();
    }

    /// Many instances are grouped by name, unless a neighbourhood is shown or the user chose.
    defaultGrouping(instances) {
        const isWhole = this.depth.value === '' || this.search.value === '';
        const many = narrow.matches ? manyOnPhone : manyInstances;
        return isWhole && instances.size > many ? 'name' : 'none';
    }

    /// Folds or unfolds a group.
    unfold(group, isOpen) {
        if (isOpen)
            this.unfolded.add(group);
        else
            this.unfolded.delete(group);
        remember({open: [...this.unfolded].join(',')});
        this.arrange();
    }

    /// Folds all groups; when they are folded, opens them all.
    foldAll() {
        if (this.unfolded.size > 0)
            this.unfolded.clear();
        else
            this.unfolded = new Set(this.groups.values());
        remember({open: [...this.unfolded].join(',')});
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
        const names = new Set([...this.instances.keys(), ...linked.map(one => one.name)]);
        this.names.replaceChildren(
            ...[...names].slice(0, maxSuggestions).map(value => h('option', {value})));
    }

    /// Lays out what is to be shown.
    arrange() {
        const objects = new Set(this.all.values()), {depth, search} = this;
        this.instances = instancesOf(objects);
        this.unlinked = unlinked(objects).sort(compareNames);
        this.grouping.value = this.chosenGrouping || this.defaultGrouping(this.instances);
        this.groups = groupsOf(this.instances, this.grouping.value);
        const isList = narrow.matches, collapsed = isList ? this.notExpanded() : this.collapsed;
        const how = {groups: this.groups, open: this.unfolded, collapsed, isList};
        let graph = build(this.all, how, this.widthOf);
        const whole = graph.boxes.length;
        if (depth.value !== '' && search.value !== '')
            graph = neighbourhood(graph, search.value, Number(depth.value));
        graph = firstBoxes(graph, maxBoxes);
        const {drawing} = this;
        const size = isList ? portrait(graph, drawing.readableWidth()) : clustered(graph);
        const shown = graph.boxes.length === whole ? counted(whole, 'box', 'boxes') :
                                                     `${graph.boxes.length} of ${whole} boxes`;
        text(this.note, `${shown}, ${counted(graph.edges.length, 'link')}`);
        this.foldButton.hidden = this.groups.size === 0;
        text(this.foldButton, this.unfolded.size > 0 ? 'Fold groups' : 'Open groups');
        this.unlinkedButton.hidden = this.unlinked.length === 0;
        text(this.unlinkedButton, `${counted(this.unlinked.length, 'instance')} without links`);
        this.empty.hidden = graph.boxes.length > 0;
        text(this.empty, this.emptyText());
        drawing.canvas.dataset.boxes = String(graph.boxes.length);
        drawing.show(graph, size, isList);
        this.follow();
    }

    notExpanded() {
        return new Set([...this.instances.keys()].filter(name => !this.expanded.has(name)));
    }

    /// Why the picture has no box.
    emptyText() {
        if (this.search.value !== '' && this.depth.value !== '')
            return `There is no box around '${this.search.value}'`;
        if (this.unlinked.length > 0)
            return 'No instance has links. The button above lists the instances.';
        return 'The machine has no instances.';
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
        const known = this.all.has(name) || this.instances.has(name),
              names = [...this.instances.keys(), ...this.all.keys()];
        const found = known ? name : names.find(other => other.includes(name));
        if (!found || name === '') return;
        this.reveal(found);
        this.select(found, true);
    }

    /// Opens the group that hides a name.
    reveal(name) {
        const hidden = boxOf(this.drawing.graph, name);
        if (!hidden?.members || hidden.id === name) return this.expand(name);
        const object = this.all.get(name);
        const pin = object?.kind === 'sig' ? this.all.get(object.writer ?? object.pins[0]) : object;
        const group = this.groups.get(pin ? instanceOf(pin) : name);
        if (group) this.unfold(group, true);
        this.expand(name);
    }

    /// Shows the ports of the box of a pin or a signal, on a narrow screen.
    expand(name) {
        const box = boxOf(this.drawing.graph, name);
        if (!box?.isList || box.members || !box.collapsed || box.id === name) return;
        this.expanded.add(box.id);
        remember({expanded: [...this.expanded].join(',')});
        this.arrange();
    }

    fold(name) {
        const group = groupName(name);
        if (group !== '') {
            this.unfold(group, !this.unfolded.has(group));
            return this.select(name, true);
        }
        const key = narrow.matches ? 'expanded' : 'collapsed', list = this[key];
        if (!list.delete(name)) list.add(name);
        remember({[key]: [...list].join(',')});
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
        if (move) this.drawing.centre(this.placeOf(name));
        const content = [
            h('button', {'aria-label': 'close', onclick: () => this.select('')}, '×'),
            h('h2', {class: 'mono'}, this.titleOf(name))
        ];
        if (groupName(name) !== '') content.push(...this.describeGroup(groupName(name)));
        if (name === unlinkedId) content.push(this.namesList(this.unlinked));
        if (object) content.push(...this.describe(object));
        if (signal)
            content.push(...await this.describeSignal(signal));
        else if (object)
            content.push(h('p', {class: 'dim'}, 'not linked'));
        const box = this.drawing.graph.boxes.find(one => one.id === name);
        if (this.unlinked.includes(name))
            content.push(h('p', {class: 'dim'}, 'no pin is linked'));
        if (box && !box.members) content.push(...this.describeBox(box));
        if (this.selected === name) this.details.replaceChildren(...content);
    }

    /// What stands for a name in the drawing: for a pin without a signal its instance.
    placeOf(name) {
        const object = this.all.get(name);
        const isShown = object?.kind !== 'pin' || boxOf(this.drawing.graph, name);
        return isShown ? name : instanceOf(object);
    }

    titleOf(name) {
        if (name === unlinkedId) return 'Instances without links';
        return groupName(name) || name;
    }

    /// Names to choose from.
    namesList(names) {
        const show = name => {
            this.reveal(name);
            this.select(name, true);
        };
        const entry = name => h('button', {class: 'plain mono', onclick: () => show(name)}, name);
        return h('ul', {class: 'plain'}, names.map(name => h('li', {}, entry(name))));
    }

    describeGroup(group) {
        const members = [...this.groups].filter(([, name]) => name === group)
                            .map(([instance]) => instance)
                            .sort(compareNames);
        const isOpen = this.unfolded.has(group);
        return [
            h('p', {class: 'dim'}, counted(members.length, 'instance')),
            h('button', {onclick: () => this.fold(groupId(group))},
              isOpen ? 'Fold group' : 'Open group'),
            this.namesList(members)
        ];
    }

    describe({type, dir, unit, doc}) {
        return [
            h('p', {}, `${type} ${dir ?? 'signal'}${unit ? `, ${unit}` : ''}`),
            doc ? h('p', {class: 'dim'}, doc) : ''
        ];
    }

    async describeSignal(signal) {
        const value = this.drawing.values.get(signal.name) ?? signal.value;
        const reply = await request({run: ['show', 'latency', signal.name]});
        const lines = reply.ok && reply.status === 0 ? JSON.parse(reply.out) : [];
        const readers = signal.pins.filter(pin => pin !== signal.writer).map(pin => {
            const found = lines.find(l => `${l} `.includes(` ${pin} `));
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
