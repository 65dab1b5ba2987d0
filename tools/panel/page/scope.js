// SPDX-License-Identifier: MIT
// The scope: up to 16 channels, time base, trigger, cursors, measurements. Samples come from a
// probe, every cycle of their threads; from a machine without probes, by subscription.
import {on, probe, subscribe} from './link.js';
import {colour, dark, h, number, surface, text} from './dom.js';
import {objects} from './objects.js';
import {Store, Trigger, measure, valueAt} from './scope_data.js';
import {Picture} from './scope_picture.js';
import {remember} from './place.js';
import {nice} from './widget_values.js';

const most = 16, divisions = 10, rows = 8, before = .2;
const hues = [210, 30, 130, 350, 270, 175, 60, 310];
const paint = i => `hsl(${hues[i % 8]} ${dark.matches ? '85% 68%' : '80% 36%'})`;
const steps = [1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, .01, .02, .05, .1, .2, .5, 1, 2];
const titles =
    ['Channel', 'units/div', 'min', 'max', 'mean', 'rms', 'frequency', 'cursor 1', 'cursor 2', 'Δ'];
const modes = [['roll', 'Roll'], ['auto', 'Auto'], ['normal', 'Normal'], ['single', 'Single']];
const edges = [['rising', 'rising'], ['falling', 'falling'], ['either', 'either edge']];

/**
 * @typedef {object} Channel
 * @property {string} name
 * @property {number} scale units per division; 0: chosen from the first values
 * @property {number} position divisions above the middle
 * @property {HTMLInputElement} [input]
 * @property {HTMLElement[]} [cells]
 */

/// A time with a unit.
function seconds(s) {
    if (s < 1e-3) return `${Number((s * 1e6).toPrecision(4))} µs`;
    if (s < 1) return `${Number((s * 1e3).toPrecision(4))} ms`;
    return `${Number(s.toPrecision(4))} s`;
}

/// The channels of a URL: name:units per division:position,…
const channelsOf = words => words.split(',').filter(word => word).slice(0, most).map(word => {
    const [name, scale, position] = word.split(':');
    return {name, scale: Number(scale) || 0, position: Number(position) || 0};
});

/// The class of a column of the table.
function columnClass(i) {
    if (i < 2) return '';
    return i < 7 ? 'n' : 'n cursor';
}

/// A list to choose from; act(value) is called for a choice.
function choose(label, values, value, act) {
    const select =
        h('select', {'aria-label': label, onchange: () => act(select.value)},
          values.map(([v, t]) => h('option', {value: v}, t)));
    select.value = String(value);
    return select;
}

const shortened = value =>
    typeof value === 'number' ? number(Number(value.toPrecision(5))) : value ?? '–';

/** The view of the scope. */
export class View {
    /**
     * @param {HTMLElement} main
     * @param {URLSearchParams} query
     */
    constructor(main, query) {
        /** @type {Channel[]} */
        this.channels = channelsOf(query.get('ch') ?? '');
        this.base = Number(query.get('base')) || .1;
        this.mode = query.get('mode') || 'roll';
        this.trigger = query.get('trigger') ?? '';
        this.edge = query.get('edge') ?? 'rising';
        this.level = Number(query.get('level')) || 0;
        this.useCursors = query.get('cursors') === '1';
        this.cursors = [.3, .7];
        this.selected = 0;
        this.dragging = null;  // 'move', or the number of a cursor

        this.store = new Store();
        this.run = true;
        this.single = false;  // a single record is shown
        this.source = '';
        /** @type {number} */
        this.shownAt = null;  // s: the right end of the picture; null: the newest
        /** @type {Trigger} */
        this.watcher = null;
        /** @type {number} */
        this.pending = null;  // s: a trigger whose record is not complete
        this.lastTrigger = 0;
        this.stopFollowing = () => {};

        this.picture = new Picture();
        this.looks = {dark: null, back: '', grid: '', text: ''};
        this.frames = 0;  // since the last measurement
        this.drawn = 0;
        this.since = performance.now();

        this.makeControls();
        this.table = h('tbody');
        this.canvas = h('canvas', {
            tabindex: 0,
            role: 'img',
            'aria-label': 'Traces; the measurements are in the table below. Space runs and ' +
                'stops, left and right change the time base, up and down move the channel, ' +
                'plus and minus scale it, a scales all.'
        });
        this.whole = h(
            'table', {class: 'channels'},
            h('thead', {},
              h('tr', {}, titles.map((title, i) => h('th', {class: columnClass(i)}, title)),
                h('th', {}, h('span', {class: 'unseen'}, 'Remove')))),
            this.table);
        main.append(
            h('div', {class: 'column'},
              h('div', {class: 'bar'}, this.add, this.names, this.timeBase, this.modes,
                this.triggerSource, this.edges, h('label', {class: 'tied'}, 'at', this.levelInput),
                this.stop, h('button', {onclick: () => this.autoscale()}, 'Auto scale'),
                this.cursorButton, this.status),
              h('div', {class: 'fill high'}, this.canvas),
              h('div', {class: 'scroll'}, this.whole)));
        this.surface = surface(
            this.canvas,
            (context, width, height, ratio) => this.paint(context, width, height, ratio), true);
        this.listen();
        this.suggest();
        this.showCursors();
        this.drawChannels();
        this.redraw = () => this.drawChannels();
        dark.addEventListener('change', this.redraw);
        this.arm();
        this.follow();
        this.measuring = setInterval(() => this.measureAll(), 500);
        this.unsubscribe = on('machine', () => {
            this.shownAt = null;
            this.suggest();
        });
    }

    end() {
        clearInterval(this.measuring);
        dark.removeEventListener('change', this.redraw);
        this.unsubscribe();
        this.stopFollowing();
        this.surface.end();
    }

    makeControls() {
        this.add = h('input', {
            type: 'search',
            list: 'scope-names',
            placeholder: 'Add a channel',
            'aria-label': 'Add a channel',
            onchange: () => this.addChannel(this.add.value.trim())
        });
        this.names = h('datalist', {id: 'scope-names'});
        this.timeBase = choose(
            'Time per division', steps.map(s => [String(s), `${seconds(s)}/div`]), this.base,
            value => {
                this.base = Number(value);
                this.save();
            });
        this.modes = choose('Mode', modes, this.mode, value => {
            Object.assign(this, {mode: value, single: false, shownAt: null, run: true});
            this.save();
        });
        this.triggerSource = choose(
            'Trigger channel', [['', 'no trigger']], '',
            value => this.setTrigger({trigger: value}));
        this.edges =
            choose('Edge', edges, this.edge, value => this.setTrigger({edge: value}));
        this.levelInput = h('input', {
            size: 7,
            inputmode: 'decimal',
            'aria-label': 'Trigger level',
            value: String(this.level),
            onchange: () => this.setTrigger({level: Number(this.levelInput.value) || 0})
        });
        this.stop = h('button', {class: 'main', onclick: () => this.toggleRun()}, 'Stop');
        this.cursorButton =
            h('button', {
                'aria-pressed': String(this.useCursors),
                onclick: () => this.toggleCursors()
            },
              'Cursors');
        this.status = h('span', {class: 'dim', id: 'scope-status'});
    }

    setTrigger(change) {
        Object.assign(this, change);
        this.save();
        this.arm();
    }

    toggleRun() {
        this.run = !this.run;
        this.single = false;
        this.draw();
    }

    toggleCursors() {
        this.useCursors = !this.useCursors;
        this.cursorButton.setAttribute('aria-pressed', String(this.useCursors));
        this.showCursors();
        this.save();
    }

    showCursors() { this.whole.classList.toggle('no-cursors', !this.useCursors); }

    async suggest() {
        const all = [...(await objects()).values()].slice(0, 3000);
        this.names.replaceChildren(...all.map(one => h('option', {value: one.name})));
    }

    /// Keeps the settings in the URL.
    save() {
        remember({
            ch: this.channels.map(c => `${c.name}:${c.scale}:${c.position}`).join(','),
            base: this.base,
            mode: this.mode,
            trigger: this.trigger,
            edge: this.edge,
            level: this.level,
            cursors: this.useCursors ? '1' : ''
        });
        this.draw();
    }

    addChannel(name) {
        const {channels} = this;
        if (name === '' || channels.length >= most || channels.some(one => one.name === name))
            return;
        channels.push({name, scale: 0, position: 0});
        this.add.value = '';
        this.save();
        this.drawChannels();
        this.follow();
    }

    removeChannel(channel) {
        this.channels = this.channels.filter(one => one !== channel);
        this.selected = 0;
        this.save();
        this.drawChannels();
        this.follow();
    }

    // ---- samples

    arm() {
        this.watcher = this.trigger ? new Trigger(this.trigger, this.edge, this.level) : null;
        this.pending = null;
    }

    follow() {
        this.stopFollowing();
        this.stopFollowing = () => {};
        this.store.clear();
        const list = this.channels.map(channel => channel.name);
        if (list.length === 0) return;
        let known = 0;
        this.stopFollowing =
            probe(list, {batch_ms: 15}, (event, bytes, layout) => {
                if (layout.layout !== known) {
                    known = layout.layout;
                    this.store.layout(layout.groups, list);
                    this.arm();
                }
                this.source = 'every cycle';
                this.store.samples(event, bytes, layout);
                this.take();
            }, () => this.followSlowly(list));
    }

    /// Follows values of a machine without probes.
    followSlowly(list) {
        this.source = 'sampled every 10 ms';
        this.store.layout([{columns: list.map((_, i) => i)}], list);
        this.arm();
        this.stopFollowing = subscribe(list, 10, (values, event) => {
            this.store.values(event);
            this.take();
        });
    }

    /// New samples are there: looks for triggers and decides which record is shown.
    take() {
        if (!this.run) return;
        if (this.mode === 'roll' || !this.watcher) {
            this.shownAt = this.store.newest;
            this.watcher?.scan(this.store);
        } else
            this.takeTriggered();
        this.surface.request();
    }

    takeTriggered() {
        const {store} = this, window = this.base * divisions, after = window * (1 - before);
        for (const time of this.watcher.scan(store)) {
            const isNew = this.shownAt === null || time > this.shownAt;
            if (this.pending === null && isNew && time - window * before >= 0) this.pending = time;
        }
        if (this.pending !== null && store.newest >= this.pending + after)
            this.showRecord(this.pending + after);
        else if (
            this.mode === 'auto' &&
            performance.now() - this.lastTrigger > Math.max(window * 1000, 300))
            this.shownAt = store.newest;
    }

    showRecord(until) {
        this.shownAt = until;
        this.lastTrigger = performance.now();
        this.pending = null;
        if (this.mode !== 'single') return;
        this.run = false;
        this.single = true;
        this.draw();
    }

    /// The shown time, from and to.
    range() {
        const to = this.shownAt ?? this.store.newest;
        return [to - this.base * divisions, to];
    }

    // ---- the picture

    autoscale() {
        const {channels} = this, [from, to] = this.range(), stacked = channels.length > 3;
        const seen = channels.map(channel => measure(this.store, channel.name, from, to)),
              each = rows / Math.max(channels.length, 1);
        channels.forEach((channel, i) => {
            if (!seen[i]) return;
            const {min, max} = seen[i];
            const span = Math.max(max - min, Math.abs(max) * 1e-3, 1e-9),
                  height = stacked ? Math.max(each, 1) : rows;
            channel.scale = nice(span / (height * .85));
            const middle = (max + min) / 2, offset = stacked ? rows / 2 - each * (i + .5) : 0;
            channel.position = Number((offset - middle / channel.scale).toFixed(2));
        });
        this.save();
    }

    paint(context, cssWidth, cssHeight, ratio) {
        this.frames++;
        const {picture, channels, canvas} = this, {width, height} = canvas;
        const thick = Math.max(1, Math.round(ratio));
        if (this.looks.dark !== dark.matches)
            this.looks = {
                dark: dark.matches,
                back: colour('--card'),
                grid: colour('--grid'),
                text: colour('--text')
            };
        picture.begin(width, height, thick, this.looks.back);
        for (let i = 1; i < divisions; i++)
            picture.vertical(width * i / divisions, this.looks.grid);
        for (let i = 1; i < rows; i++)
            picture.horizontal(height / rows * i, this.looks.grid);
        channels.forEach((channel, i) => {
            this.chooseScale(channel);
            if (i !== this.selected) this.drawChannel(channel, i, thick);
        });
        const top = channels[this.selected];
        if (top) this.drawChannel(top, this.selected, 2 * thick);
        if (this.useCursors)
            for (const at of this.cursors)
                picture.vertical(width * at, this.looks.text);
        context.putImageData(picture.image, 0, 0);
        if (this.useCursors) this.labelCursors(context, cssWidth);
    }

    labelCursors(context, width) {
        context.fillStyle = this.looks.text;
        context.font = '12px system-ui, sans-serif';
        this.cursors.forEach(
            (at, i) =>
                context.fillText(String(i + 1), Math.min(width * at + 4, width - 10), 12));
    }

    /// Chooses the scale of a new channel from its first values.
    chooseScale(channel) {
        if (channel.scale !== 0 || this.store.rows <= 20) return;
        const [from, to] = this.range(), seen = measure(this.store, channel.name, from, to);
        if (seen)
            channel.scale =
                nice(Math.max(seen.max - seen.min, Math.abs(seen.max), 1e-9) / (rows * .4));
    }

    drawChannel(channel, i, thick) {
        if (!channel.scale) return;
        const {picture, canvas} = this, [from, to] = this.range(), dy = canvas.height / rows;
        const zero = canvas.height / 2 - dy * channel.position, perUnit = dy / channel.scale;
        picture.trace(
            this.store, channel.name, from, to, zero, perUnit,
            {name: paint(i), thick, dashed: i >= 8});
        if (channel.name !== this.trigger || this.mode === 'roll') return;
        picture.horizontal(zero - this.level * perUnit, paint(i), true);
        picture.vertical(canvas.width * before, paint(i), true);
    }

    draw() {
        text(this.stop, this.run ? 'Stop' : 'Run');
        this.surface.request();
    }

    // ---- the table

    drawChannels() {
        const {channels} = this,
              sources = [['', 'no trigger'], ...channels.map(c => [c.name, c.name])];
        this.triggerSource.replaceChildren(...sources.map(([v, t]) => h('option', {value: v}, t)));
        this.triggerSource.value =
            channels.some(c => c.name === this.trigger) ? this.trigger : '';
        this.whole.hidden = channels.length === 0;
        this.table.replaceChildren(...channels.map((channel, i) => this.channelRow(channel, i)));
    }

    channelRow(channel, i) {
        const swatch = h('span', {class: 'swatch'});
        swatch.style.background = i < 8 ?
            paint(i) :
            `repeating-linear-gradient(90deg, ${paint(i)} 0 5px, transparent 5px 8px)`;
        channel.input = h('input', {
            class: 'short',
            value: channel.scale ? String(channel.scale) : 'auto',
            'aria-label': `${channel.name}: units per division`,
            onchange: () => {
                channel.scale = Number(channel.input.value) || 0;
                this.save();
            }
        });
        channel.cells = Array.from(
            {length: 8}, (_, k) => h('td', {class: k < 5 ? 'n mono' : 'n mono cursor'}, '–'));
        const name =
            h('button', {
                class: 'plain mono',
                'aria-pressed': String(i === this.selected),
                onclick: () => {
                    this.selected = i;
                    this.drawChannels();
                    this.draw();
                }
            },
              swatch, channel.name);
        const remove =
            h('button', {
                class: 'plain',
                'aria-label': `remove ${channel.name}`,
                onclick: () => this.removeChannel(channel)
            },
              '×');
        return h(
            'tr', {'data-channel': channel.name}, h('td', {}, name), h('td', {}, channel.input),
            channel.cells, h('td', {}, remove));
    }

    measureAll() {
        this.channels.forEach(channel => this.measureChannel(channel));
        const now = performance.now(), fps = this.frames * 1000 / (now - this.since);
        this.drawn += this.frames;
        this.frames = 0;
        this.since = now;
        text(this.status, this.statusText());
        const {store, shownAt, lastTrigger} = this;
        const shownNow = {
            rows: store.rows,
            lost: store.lost,
            gaps: store.gaps,
            fps,
            frames: this.drawn,
            shownAt,
            lastTrigger,
            pre: this.base * divisions * before,
            store,
            range: this.range()
        };
        Object.assign(window, {halcyonScope: shownNow});  // for tests
    }

    measureChannel(channel) {
        if (!channel.cells) return;
        const {store, useCursors} = this, [from, to] = this.range();
        const times = this.cursors.map(at => from + (to - from) * at),
              [begin, end] = useCursors ? [...times].sort((a, b) => a - b) : [from, to];
        const seen = measure(store, channel.name, begin, end);
        const at = useCursors ? times.map(time => valueAt(store, channel.name, time)) :
                                [null, null];
        const known = seen && seen.frequency !== null,
              frequency = known ? `${shortened(seen.frequency)} Hz` : '?',
              difference = at.includes(null) ? null : at[1] - at[0];
        [seen?.min, seen?.max, seen?.mean, seen?.rms, frequency, ...at, difference].forEach(
            (value, k) => text(channel.cells[k], shortened(value)));
        if (document.activeElement !== channel.input && channel.scale)
            channel.input.value = String(Number(channel.scale.toPrecision(3)));
    }

    statusText() {
        if (this.channels.length === 0) return 'Add a channel: a pin, signal or parameter';
        const {store} = this, parts = [this.source, `${store.rows} rows`, `${store.lost} lost`];
        if (!this.run) parts.push(this.single ? 'single record' : 'stopped');
        const late = performance.now() - this.lastTrigger > 1000;
        if (this.mode !== 'roll' && this.trigger && this.run && late)
            parts.push('waiting for trigger');
        if (this.useCursors) {
            const distance = Math.abs(this.cursors[1] - this.cursors[0]) * this.base * divisions;
            parts.push(`Δt ${seconds(distance)}`);
        }
        return parts.join(', ');
    }

    // ---- pointer and keys

    listen() {
        const {canvas} = this;
        canvas.addEventListener('pointerdown', event => this.pressed(event));
        canvas.addEventListener('pointermove', event => this.dragged(event));
        canvas.addEventListener('pointerup', () => {
            if (this.dragging === 'move') this.save();
            this.dragging = null;
        });
        canvas.addEventListener('wheel', event => {
            event.preventDefault();
            this.shiftBase(Math.sign(event.deltaY));
        }, {passive: false});
        canvas.addEventListener('keydown', event => {
            if (!this.typed(event)) return;
            event.preventDefault();
            this.save();
        });
    }

    pressed(event) {
        const at = event.offsetX / this.canvas.clientWidth, [first, second] = this.cursors;
        const nearest = Math.abs(at - first) < Math.abs(at - second) ? 0 : 1;
        this.dragging = this.useCursors ? nearest : 'move';
        this.canvas.setPointerCapture(event.pointerId);
    }

    dragged(event) {
        if (this.dragging === null) return;
        const channel = this.channels[this.selected];
        if (this.dragging !== 'move')
            this.cursors[this.dragging] =
                Math.min(1, Math.max(0, event.offsetX / this.canvas.clientWidth));
        else if (channel)
            channel.position -= event.movementY * rows / this.canvas.clientHeight;
        this.surface.request();
    }

    shiftBase(by) {
        const index = steps.findIndex(s => s >= this.base) + by;
        this.base = steps[Math.min(steps.length - 1, Math.max(0, index))];
        this.timeBase.value = String(this.base);
        this.save();
    }

    /// Returns whether the key means something.
    typed({key, ctrlKey, shiftKey}) {
        const channel = this.channels[this.selected];
        const signs = {ArrowLeft: -1, ArrowRight: 1, ArrowDown: -1, ArrowUp: 1}, sign = signs[key];
        if (key === ' ')
            this.stop.click();
        else if ((key === 'ArrowLeft' || key === 'ArrowRight') && this.useCursors)
            this.cursors[ctrlKey ? 1 : 0] += sign * (shiftKey ? .01 : .001);
        else if (key === 'ArrowLeft' || key === 'ArrowRight')
            this.shiftBase(sign);
        else if ((key === 'ArrowUp' || key === 'ArrowDown') && channel)
            channel.position += sign * (shiftKey ? 1 : .1);
        else if ((key === '+' || key === '-') && channel)
            channel.scale = nice(channel.scale * (key === '+' ? .45 : 1.9));
        else if (key === 'a')
            this.autoscale();
        else if (key >= '1' && key <= '9' && this.channels[Number(key) - 1]) {
            this.selected = Number(key) - 1;
            this.drawChannels();
        } else
            return false;
        return true;
    }
}
