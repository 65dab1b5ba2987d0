// SPDX-License-Identifier: MIT
// The scope: up to 16 channels, time base, trigger, cursors, measurements. Samples come from a
// probe, every cycle of their threads; from a machine without probes, by subscription.
import {on, probe, readAround, readRecording, state, subscribe} from './link.js';
import {announce, colour, dark, h, number, pictureInterval, surface, text} from './dom.js';
import {compareNames, similar} from './names.js';
import {objects} from './objects.js';
import {channelTitle, isStack, seconds, timeLabels, valueLabels} from './scope_axes.js';
import {Store, Trigger, measure, valueAt} from './scope_data.js';
import {csv, download, overwritten} from './scope_export.js';
import {FaultTrigger, faultSource, isFaultSource, nameOfFaults} from './scope_fault_trigger.js';
import {Labels, fitted, write} from './scope_labels.js';
import {mcap} from './scope_mcap.js';
import {Picture} from './scope_picture.js';
import {Roll} from './scope_roll.js';
import {spectrum} from './scope_spectrum.js';
import {SpectrumPane} from './scope_spectrum_pane.js';
import {stepResponse} from './scope_step.js';
import {XyPane} from './scope_xy_pane.js';
import {remember} from './place.js';
import {timeText} from './timeline_moves.js';
import {nice} from './widget_values.js';

const most = 16, divisions = 10, rows = 8, before = .2;
const labelWidth = 56;  // px: of a time
const hues = [210, 30, 130, 350, 270, 175, 60, 310];
const paint = i => `hsl(${hues[i % 8]} ${dark.matches ? '85% 68%' : '80% 36%'})`;
const steps = [
    1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, .01, .02, .05, .1, .2, .5, 1, 2, 5, 10, 30, 60
];
const columns = [
    ['Channel'], ['units/div'], ['rise time', 'n step'], ['overshoot', 'n step'],
    ['settling time', 'n step'], ['min', 'n'], ['max', 'n'], ['mean', 'n'], ['rms', 'n'],
    ['σ', 'n'], ['frequency', 'n'], ['cursor 1', 'n cursor'], ['cursor 2', 'n cursor'],
    ['Δ', 'n cursor']
];
const modes = [['roll', 'Roll'], ['auto', 'Auto'], ['normal', 'Normal'], ['single', 'Single']];
const pages = {PageUp: -divisions / 2, PageDown: divisions / 2, Home: -Infinity, End: Infinity};
const edges = [['rising', 'rising'], ['falling', 'falling'], ['either', 'either edge']];

/**
 * @typedef {object} Channel
 * @property {string} name
 * @property {number} scale units per division; 0: chosen from the first values
 * @property {number} position divisions above the middle
 * @property {boolean} [unknown] the machine has no such name
 * @property {string} [unit]
 * @property {HTMLInputElement} [input]
 * @property {HTMLElement[]} [cells]
 */

/// The channels of a URL: name:units per division:position,…
const channelsOf = list => list.split(',').filter(entry => entry).slice(0, most).map(entry => {
    const [name, scale, position] = entry.split(':');
    return {name, scale: Number(scale) || 0, position: Number(position) || 0};
});

/// A list to choose from; act(value) is called for a choice.
function choose(label, values, value, act) {
    const select =
        h('select', {'aria-label': label, onchange: () => act(select.value)},
          values.map(([v, t]) => h('option', {value: v}, t)));
    select.value = String(value);
    return select;
}

/// Replaces what a list has to choose from; a value that is not in it becomes the first one.
function fill(select, values, value) {
    select.replaceChildren(...values.map(([v, t]) => h('option', {value: v}, t)));
    select.value = values.some(([v]) => v === value) ? value : values[0][0];
}

const shortened = value =>
    typeof value === 'number' ? number(Number(value.toPrecision(5))) : value ?? '–';

/// A value, or 0 for what rounding errors of values of this size leave of 0.
const rounded = (value, size) =>
    typeof value === 'number' && Math.abs(value) < 1e-12 * size ? 0 : value;

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
        this.useSteps = query.get('step') === '1';
        this.useSpectrum = query.get('spectrum') === '1';
        this.recording = query.get('recording') ?? '';  // the name of one; '': the machine
        this.hasBase = query.has('base');
        /** @type {{time_ns: number, kind: string, text: string}[]} */
        this.recorded = [];  // what happened in the recording
        this.hasLooked = false;  // the end of the recording was shown; the picture stays
        /** @type {{at: number, text: string}[]} */
        this.knownFaults = null;  // of allFaults(); null: to be read again
        this.main = main;
        this.across = query.get('x') ?? '';  // the channel of the X axis; '': no XY view
        this.cursors = [.3, .7];
        this.selected = 0;
        this.dragging = null;  // 'press', 'move', 'scroll', or the number of a cursor

        this.isOpen = true;
        /** @type {string[]} */
        this.around = null;  // names to be read around the moment of a replayed machine
        this.isReading = false;
        this.store = new Store();
        this.run = true;
        this.single = false;  // a single record is shown
        this.source = '';
        /** @type {number} */
        this.shownAt = null;  // s: the right end of the picture; null: the newest
        this.zeroAt = 0;  // s: time 0 of the picture, a trigger or the newest sample
        /** @type {Trigger | FaultTrigger} */
        this.watcher = null;
        /** @type {number} */
        this.pending = null;  // s: a trigger whose record is not complete
        this.lastTrigger = 0;
        this.recordEnd = -Infinity;  // s: of the last record that a trigger began
        this.triggered = false;  // the shown record begins with a trigger
        this.stopFollowing = () => {};
        this.following = 0;  // counts calls of follow(): reading the names takes time
        this.followed = '';  // the names whose samples are read
        this.lastSamples = performance.now();
        /** @type {{from: number, to: number}[]} */
        this.stops = [];  // s: when the functions of the machine did not run

        this.picture = new Picture();
        this.roll = new Roll();
        /** @type {import('./scope_roll.js').Back} */
        this.rowColours = null;  // of behind()
        this.labels = new Labels();
        this.looks = {dark: null, back: '', grid: '', text: '', dim: '', bad: ''};
        this.measurements = 0;
        this.frames = 0;  // since the last measurement
        this.drawn = 0;
        this.since = performance.now();

        this.makeControls();
        this.spectrumPane = new SpectrumPane();
        this.xyPane = new XyPane();
        this.table = h('tbody');
        this.canvas = h('canvas', {
            tabindex: 0,
            role: 'img',
            'aria-label': 'Traces; the measurements are in the table below. Space runs and ' +
                'stops, left and right change the time base, up and down move the channel, ' +
                'plus and minus scale it, a scales all, page up and page down scroll in time.'
        });
        this.whole =
            h('table', {class: 'channels'},
              h('thead', {},
                h('tr', {}, columns.map(([title, kind]) => h('th', {class: kind}, title)),
                  h('th', {}, h('span', {class: 'unseen'}, 'Remove')))),
              this.table);
        main.append(
            h('div', {class: 'column'},
              h('div', {class: 'bar'}, this.sources, this.add, this.names, this.timeBase,
                this.modes, this.triggerSource, this.edges, this.levelLabel, this.faultsOf,
                this.stop,
                h('button', {onclick: () => this.autoscale()}, 'Auto scale'), this.cursorButton,
                this.stepButton, this.spectrumButton, this.acrossSource,
                h('button', {onclick: () => this.saveTable()}, 'CSV'),
                h('button', {onclick: () => this.saveRecording()}, 'MCAP'),
                h('button', {onclick: () => this.savePicture()}, 'PNG'), this.status, this.problem),
              h('div', {class: 'pictures'}, h('div', {class: 'fill'}, this.canvas),
                this.xyPane.element),
              this.history, this.spectrumPane.element,
              h('div', {class: 'scroll'}, this.whole)));
        this.surface = surface(
            this.canvas,
            (context, width, height, ratio) => this.paint(context, width, height, ratio), true);
        this.listen();
        this.suggest();
        this.showCursors();
        this.showSpectrum();
        this.showXy();
        this.drawChannels();
        this.drawSources();
        this.main.classList.toggle('recorded', this.recording !== '');
        this.redraw = () => this.drawChannels();
        dark.addEventListener('change', this.redraw);
        this.arm();
        this.follow();
        this.measuring = setInterval(() => this.measureAll(), 500);
        this.subscriptions = [
            on('machine',
               () => {
                   if (this.recording !== '') return;
                   this.shownAt = null;
                   this.suggest();
                   this.follow(true);
               }),
            on('welcome',
               () => {
                   this.drawSources();
                   if (this.recording === '') return;
                   this.suggest();
                   this.follow();
               }),
            on('moment', () => this.followMoment()), on('state', () => this.noteState()),
            on('logged', () => {
                this.knownFaults = null;
                this.surface.request();
            })
        ];
    }

    end() {
        this.isOpen = false;
        clearInterval(this.measuring);
        dark.removeEventListener('change', this.redraw);
        this.following++;
        this.subscriptions.forEach(unsubscribe => unsubscribe());
        this.stopFollowing();
        this.main.classList.remove('recorded');
        this.surface.end();
        this.spectrumPane.end();
        this.xyPane.end();
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
        this.sources = choose('Source', [['', 'machine']], '', value => {
            this.recording = value;
            this.hasBase = false;
            this.save();
            this.changeSource();
        });
        this.timeBase = choose(
            'Time per division', steps.map(s => [String(s), `${seconds(s)}/div`]), this.base,
            value => {
                this.base = Number(value);
                this.save();
                if (state.past) this.followMoment();
            });
        this.modes = choose('Mode', modes, this.mode, value => {
            Object.assign(this, {mode: value, single: false, shownAt: null, run: true});
            this.save();
        });
        this.triggerSource = choose(
            'Trigger channel', [['', 'no trigger']], '',
            value => this.setTrigger({trigger: value}));
        this.faultsOf = h('input', {
            size: 14,
            list: 'scope-names',
            placeholder: 'of any instance',
            'aria-label': 'Instance or thread whose faults trigger',
            value: isFaultSource(this.trigger) ? nameOfFaults(this.trigger) : '',
            onchange: () => this.setTrigger({trigger: faultSource(this.faultsOf.value.trim())})
        });
        this.edges = choose('Edge', edges, this.edge, value => this.setTrigger({edge: value}));
        this.levelInput = h('input', {
            size: 7,
            inputmode: 'decimal',
            'aria-label': 'Trigger level',
            value: String(this.level),
            onchange: () => this.setTrigger({level: Number(this.levelInput.value) || 0})
        });
        this.levelLabel = h('label', {class: 'tied live'}, 'at', this.levelInput);
        this.acrossSource = choose('X axis of the XY view', [['', 'no XY']], '', value => {
            this.across = value;
            this.showXy();
            this.save();
        });
        const slider = h('input', {
            type: 'range',
            min: -1,
            max: 0,
            step: 'any',
            'aria-label': 'Scroll back in time',
            oninput: () => this.scrollTo(this.store.newest + Number(slider.value))
        });
        this.slider = slider;
        this.back = h('span', {class: 'dim'});
        this.history = h('div', {class: 'history'}, slider, this.back);
        for (const element of [this.modes, this.triggerSource, this.edges, this.faultsOf])
            element.classList.add('live');
        this.stop = h('button', {class: 'main live', onclick: () => this.toggleRun()}, 'Stop');
        this.cursorButton =
            h('button',
              {'aria-pressed': String(this.useCursors), onclick: () => this.toggleCursors()},
              'Cursors');
        this.stepButton =
            h('button', {
                'aria-pressed': String(this.useSteps),
                title: 'Rise time (10 % to 90 %), overshoot and settling time (2 %) of a step ' +
                    'from cursor 1 to cursor 2, or from the trigger on',
                onclick: () => this.toggleSteps()
            },
              'Step');
        this.spectrumButton =
            h('button', {
                'aria-pressed': String(this.useSpectrum),
                title: 'Amplitude spectrum of the selected channel, between the cursors or over ' +
                    'the whole picture',
                onclick: () => this.toggleSpectrum()
            },
              'Spectrum');
        this.problem = h('span', {class: 'bad', id: 'scope-problem', role: 'status'});
        this.status = h('span', {class: 'dim', id: 'scope-status'});
    }

    setTrigger(change) {
        Object.assign(this, change);
        this.drawTrigger();
        this.save();
        this.arm();
    }

    toggleRun() {
        this.run = !this.run;
        this.single = false;
        this.draw();
        this.drawHistory();
    }

    /// Stops the picture, with its right end at a time of the record.
    scrollTo(time) {
        const {oldest, newest} = this.store;
        const first = Math.min(newest, oldest + this.base * divisions);
        this.run = false;
        this.shownAt = Math.min(newest, Math.max(first, time));
        this.draw();
        this.drawHistory();
    }

    /// Moves the picture by some divisions, negative to older samples.
    scroll(by) { this.scrollTo((this.shownAt ?? this.store.newest) + by * this.base); }

    /// Updates the slider that scrolls back.
    drawHistory() {
        const {slider, store} = this, kept = store.newest - store.oldest;
        const behind = Math.max(0, store.newest - this.range()[1]);
        const scrollable = kept - this.base * divisions, isShort = !(scrollable > 0);
        const isMoment = this.recording === '' && state.past !== null;  // the time line moves it
        this.history.hidden = isShort || isMoment;
        slider.min = String(Math.min(-1e-3, -scrollable));
        if (document.activeElement !== slider || this.run) slider.value = String(-behind);
        text(this.back, this.run ? `${seconds(kept)} kept` :
                                   `${seconds(behind)} back of ${seconds(kept)}`);
    }

    toggleCursors() {
        this.useCursors = !this.useCursors;
        this.cursorButton.setAttribute('aria-pressed', String(this.useCursors));
        this.showCursors();
        this.save();
    }

    toggleSteps() {
        this.useSteps = !this.useSteps;
        this.stepButton.setAttribute('aria-pressed', String(this.useSteps));
        this.showCursors();
        this.save();
    }

    toggleSpectrum() {
        this.useSpectrum = !this.useSpectrum;
        this.spectrumButton.setAttribute('aria-pressed', String(this.useSpectrum));
        this.showSpectrum();
        this.save();
    }

    showSpectrum() {
        this.spectrumPane.element.hidden = !this.useSpectrum;
        this.measureSpectrum();
    }

    /// The channels of the XY view; null when it is off.
    xyChannels() {
        const x = this.channels.find(one => one.name === this.across),
              y = this.channels[this.selected] ?? null;
        if (!x || !y) return null;
        return {x, y: x === y ? this.channels.find(one => one !== x) ?? y : y};
    }

    /// Draws the XY view, if it is shown. `forced`: also when it was drawn just now.
    showXy(forced = true) {
        const found = this.xyChannels(), {element} = this.xyPane;
        // Writing an attribute makes the browser lay out the page: not in every frame.
        if (element.hidden !== (found === null)) element.hidden = found === null;
        if (!found) return;
        const tone = paint(this.channels.indexOf(found.y));
        this.xyPane.show(this.store, found.x, found.y, this.measured(), tone, forced);
    }

    /**
     * The time that is measured: between the cursors, or all that is shown.
     * @returns {[number, number]}
     */
    measured() {
        const [from, to] = this.range(), [first, second] = this.cursors;
        if (!this.useCursors) return [from, to];
        const at = share => from + (to - from) * share;
        return [at(Math.min(first, second)), at(Math.max(first, second))];
    }

    /// The spectrum of the selected channel, between the cursors if there are any.
    measureSpectrum() {
        const channel = this.channels[this.selected];
        if (!this.useSpectrum || !channel) return null;
        const [begin, end] = this.measured();
        const found = spectrum(this.store, channel.name, begin, end);
        this.spectrumPane.show(found, channel.name, channel.unit, paint(this.selected));
        return found?.peak ?? null;
    }

    showCursors() {
        this.whole.classList.toggle('no-cursors', !this.useCursors);
        this.whole.classList.toggle('no-step', !this.useSteps);
    }

    /// Lists the recordings that hal panel has, and shows the source.
    drawSources() {
        const names = state.recordings.map(({name}) => name);
        this.sources.hidden = names.length === 0;
        fill(this.sources, [['', 'machine'], ...names.map(name => [name, name])], this.recording);
        if (state.server === 'up' && this.recording !== '' && !names.includes(this.recording))
            this.leaveMissing();
    }

    /// Shows the machine instead of a recording that hal panel does not have.
    leaveMissing() {
        const name = this.recording;
        this.recording = '';
        this.save();
        this.changeSource();
        this.report(`hal panel has no recording '${name}'; start it with --recording FILE`);
    }

    /// Shows the machine or a recording from now on.
    changeSource() {
        Object.assign(this, {shownAt: null, followed: '', source: '', run: true, single: false});
        this.hasLooked = false;
        this.report('');
        this.main.classList.toggle('recorded', this.recording !== '');
        this.suggest();
        this.follow();
        this.draw();
    }

    /// What can be a channel: names with their type and unit.
    async known(fresh = false) {
        if (this.recording === '') return objects(fresh);
        const found = state.recordings.find(({name}) => name === this.recording);
        return new Map((found?.columns ?? []).map(column => [column.name, column]));
    }

    async suggest() {
        const all = [...(await this.known()).keys()].sort(compareNames).slice(0, 3000);
        this.names.replaceChildren(...all.map(name => h('option', {value: name})));
    }

    // ---- files

    saveTable() {
        const [from, to] = this.range(), names = this.channels.map(one => one.name);
        const {isEmpty, problem} = overwritten(this.store, names, from, to, ' of the picture');
        this.report(problem);
        if (isEmpty) return;
        const table = csv(this.store, names, from, to);
        download('scope.csv', new Blob([table], {type: 'text/csv'}));
    }

    /// Saves all samples that are kept, with what happened meanwhile.
    saveRecording() {
        const {store} = this, names = this.channels.map(one => one.name), from = store.oldest;
        const first = store.origin ?? Infinity;
        const events = this.happened().filter(one => one.time_ns >= first);
        // The running machine is not the one of a recording.
        const about = this.recording === '' ? state : {instance: '', version: ''};
        const file = mcap(store, names, from, store.newest, events, about);
        this.report(overwritten(store, names, from, store.newest).problem);
        download('scope.mcap', new Blob([file], {type: 'application/octet-stream'}));
    }

    savePicture() {
        this.canvas.toBlob(blob => {
            if (blob) download('scope.png', blob);
        });
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
            cursors: this.useCursors ? '1' : '',
            step: this.useSteps ? '1' : '',
            spectrum: this.useSpectrum ? '1' : '',
            x: this.across,
            recording: this.recording
        });
        this.draw();
    }

    /// Adds a channel, if the machine has that name. Otherwise nothing changes.
    async addChannel(name) {
        if (name === '') return this.report('');
        const problem = await this.problemOf(name);
        if (problem) return this.report(...problem);
        this.report('');
        this.channels.push({name, scale: 0, position: 0});
        this.add.value = '';
        this.save();
        this.drawChannels();
        this.follow();
    }

    /// Why a name cannot be a channel, and what was probably meant; null for a good name.
    async problemOf(name) {
        if (this.channels.some(one => one.name === name)) return [`'${name}' is already shown`];
        if (this.channels.length >= most) return [`the scope has at most ${most} channels`];
        let all = await this.known();
        if (!all.has(name)) all = await this.known(true);  // it may be new
        const type = all.get(name)?.type;
        if (type === 'port') return [`'${name}' is a port, which has no number`];
        if (type) return null;
        if (!state.machine && this.recording === '')
            return [
                state.machine === null ? 'the names of the machine are not known yet' :
                                         'the machine is not running'
            ];
        return [`unknown name '${name}'`, similar(name, all.keys())];
    }

    report(problem, instead = []) {
        const offers = instead.map(
            name => h('button', {class: 'mono', onclick: () => this.addChannel(name)}, name));
        this.problem.replaceChildren(
            problem, offers.length > 0 ? '; did you mean: ' : '', ...offers);
        if (problem)
            announce(
                instead.length > 0 ? `${problem}; did you mean ${instead.join(', ')}` : problem);
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
        this.watcher = this.makeTrigger();
        this.pending = null;
        this.recordEnd = -Infinity;
    }

    makeTrigger() {
        if (this.trigger === '') return null;
        if (isFaultSource(this.trigger))
            return new FaultTrigger(nameOfFaults(this.trigger), () => this.allFaults());
        return new Trigger(this.trigger, this.edge, this.level);
    }

    /// Reads the samples of all channels that the machine has. `restarted`: the page follows the
    /// same names again by itself.
    async follow(restarted = false) {
        const call = ++this.following, all = await this.known();
        if (call !== this.following) return;
        for (const channel of this.channels) {
            channel.unknown = all.size > 0 && !all.has(channel.name);
            channel.unit = all.get(channel.name)?.unit ?? '';
        }
        this.drawChannels();
        const list = this.channels.filter(one => !one.unknown).map(one => one.name);
        if (restarted && list.join() === this.followed) return;
        this.followed = list.join();
        this.stopFollowing();
        this.stopFollowing = () => {};
        this.store.clear();
        this.knownFaults = null;
        this.stops = [];
        if (list.length === 0) return;
        if (this.recording !== '') return this.showRecording(list, call);
        if (state.past) return this.showMoment(list);
        let known = 0;
        const options = {batch_ms: pictureInterval};
        this.stopFollowing = probe(list, options, (event, bytes, layout) => {
            if (layout.layout !== known) {
                known = layout.layout;
                this.store.layout(layout.groups, list, layout.columns);
                this.store.unixOffset = layout.unix_ns - layout.time_ns;
                this.knownFaults = null;
                this.stops = [];
                this.arm();
            }
            this.source = 'every cycle';
            this.store.samples(event, bytes, layout);
            this.take();
        }, () => this.followSlowly(list));
    }

    /// Shows channels of a recording.
    async showRecording(names, call) {
        const index = state.recordings.findIndex(({name}) => name === this.recording);
        if (index < 0) return;
        const reply = await readRecording(index, names, (event, bytes) => {
            if (call !== this.following) return;
            this.store.samples(event, bytes, reply);
            if (!this.hasLooked) return this.lookAtEnd();
            this.scrollTo(this.shownAt ?? this.store.newest);
        });
        if (call !== this.following) return;
        if (!reply.ok) return this.report(reply.error);
        const {left_out, groups, columns, unix_ns, events} = reply;
        const {notes, seconds: length} = state.recordings[index];
        this.report(notes.join('; '));
        this.store.layout(groups, names, columns, length);
        this.store.unixOffset = unix_ns;
        this.store.seconds(0);
        this.recorded = events;
        this.knownFaults = null;
        this.source = `recording ${this.recording}` +
            (left_out > 0 ? `, ${left_out} earlier rows not shown` : '');
    }

    /// The machine has another moment: reads the samples around it, at most one request at a time.
    followMoment() {
        if (this.recording !== '' || state.past?.moment?.moving) return;
        this.showMoment(this.followed.split(',').filter(name => name));
    }

    /// Shows channels of a replayed machine around its moment, which is in the middle.
    async showMoment(names) {
        this.around = names;
        if (this.isReading || names.length === 0) return;
        this.isReading = true;
        while (this.around && this.isOpen) {
            const wanted = this.around, half = this.base * divisions / 2;
            this.around = null;
            const milliseconds = Math.min(60000, Math.ceil(half * 1000) + 1);
            await this.readMoment(wanted, milliseconds, half);
        }
        this.isReading = false;
    }

    async readMoment(names, milliseconds, half) {
        const reply = await readAround(names, milliseconds, milliseconds, (event, bytes) => {
            if (!this.isOpen || names.join() !== this.followed) return;
            this.store.layout(reply.groups, names, reply.columns);
            this.store.unixOffset = reply.unix_ns;
            this.store.seconds(0);
            this.store.samples(event, bytes, reply);
            this.recorded = state.past?.timeline?.marks ?? [];
            this.knownFaults = null;
            this.zeroAt = reply.moment_ns / 1e9;
            this.triggered = true;
            this.source = `around ${timeText(reply.moment_ns)}` +
                (reply.left_out > 0 ? `, ${reply.left_out} earlier rows not shown` : '');
            this.canvas.dataset.moment = String(reply.moment_ns);
            this.scrollTo(this.zeroAt + half);
        });
        if (!reply.ok && !/interrupted/.test(reply.error)) this.report(reply.error);
    }

    /// Shows the end of what is kept; when no time base was chosen, all of it.
    lookAtEnd() {
        const {store} = this, length = store.newest - store.oldest;
        this.hasLooked = true;
        if (!this.hasBase) this.base = steps.find(step => step * divisions >= length) ?? 60;
        this.timeBase.value = String(this.base);
        this.zeroAt = store.newest;
        this.triggered = false;
        this.scrollTo(store.newest);
        this.save();
    }

    /// Follows values of a machine without probes.
    followSlowly(list) {
        this.source = 'sampled every 10 ms';
        const every_ms = 10;
        this.store.layout(
            [{columns: list.map((_, i) => i), thread: 'values', period_ns: every_ms * 1e6}], list);
        this.arm();
        this.stopFollowing = subscribe(list, every_ms, (values, event) => {
            this.store.values(event);
            this.take();
        });
    }

    /// New samples are there: looks for triggers and decides which record is shown.
    take() {
        this.lastSamples = performance.now();
        if (this.stops.length === 0 && !state.running) this.noteState();
        if (!this.run) return;
        const before = this.shownAt;
        if (this.mode === 'roll' || !this.watcher) {
            this.shownAt = this.zeroAt = this.store.newest;
            this.triggered = false;
            this.watcher?.scan(this.store);
        } else
            this.takeTriggered();
        // A record that waits for the next trigger stays as it is.
        if (this.shownAt !== before || before === null) this.surface.follow();
    }

    takeTriggered() {
        const {store} = this, window = this.base * divisions, after = window * (1 - before);
        for (const time of this.watcher.scan(store)) {
            const isNew = time > this.recordEnd;
            if (this.pending === null && isNew && time - window * before >= 0) this.pending = time;
        }
        if (this.pending !== null && store.newest >= this.pending + after)
            this.showRecord(this.pending + after);
        else if (
            this.mode === 'auto' &&
            performance.now() - this.lastTrigger > Math.max(window * 1000, 300)) {
            this.shownAt = this.zeroAt = store.newest;
            this.triggered = false;
        }
    }

    showRecord(until) {
        this.shownAt = this.recordEnd = until;
        this.zeroAt = this.pending;
        this.triggered = true;
        this.lastTrigger = performance.now();
        this.pending = null;
        if (this.mode !== 'single') return;
        this.run = false;
        this.single = true;
        this.draw();
    }

    /// Remembers when the functions did not run.
    noteState() {
        if (this.recording !== '' || state.past) return;
        const {store, stops} = this, open = stops.find(one => one.to === Infinity);
        const exact = state.running_ns > 0 && store.origin !== null;
        const now = exact ? store.seconds(state.running_ns) : store.newest;
        if (!state.running && !open) stops.push({from: now, to: Infinity});
        if (state.running && open) open.to = now;
        if (stops.length > 100) stops.shift();
        this.surface.request();
    }

    /// Why the newest samples are not those of a running machine; empty when they are.
    notice() {
        if (this.recording !== '' || state.past) return '';
        if (!state.machine) return 'machine not running';
        if (!state.responding) return 'machine not responding';
        if (!state.running) return 'stopped: functions do not run';
        const silent = (performance.now() - this.lastSamples) / 1000;
        return silent > 1 && this.followed !== '' ? `no samples for ${Math.floor(silent)} s` : '';
    }

    /// What happened, with a time on the clock of the samples.
    happened() {
        if (this.recording !== '' || state.past) return this.recorded;
        return state.log.filter(one => one.time_ns > 0);
    }

    /// All faults since the record began.
    allFaults() {
        this.knownFaults ??= this.readFaults();
        return this.knownFaults ?? [];
    }

    /// Null before the first sample, whose time is that of all others.
    readFaults() {
        const {store} = this;
        if (store.origin === null) return null;
        return this.happened()
            .filter(one => one.kind === 'fault')
            .map(one => ({at: store.seconds(one.time_ns), text: one.text}));
    }

    /// The faults during the shown time.
    faults() {
        const [from, to] = this.range();
        return this.allFaults().filter(({at}) => at >= from && at <= to);
    }

    /// The shown time, from and to.
    range() {
        const to = this.shownAt ?? this.store.newest;
        return [to - this.base * divisions, to];
    }

    // ---- the picture

    autoscale() {
        const {channels} = this, [from, to] = this.range(), stacked = isStack(channels);
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
                text: colour('--text'),
                dim: colour('--dim'),
                bad: colour('--bad')
            };
        picture.begin(
            width, height, thick, this.looks.back, this.stopsKey(), () => this.drawGround());
        for (const channel of channels)
            this.chooseScale(channel);
        if (!this.drawRolled(thick)) this.drawAll(thick);
        channels.forEach((channel, i) => this.drawMarks(channel, i, thick, ratio));
        if (this.useCursors)
            for (const at of this.cursors)
                picture.vertical(width * at, this.looks.text);
        const [from, to] = this.range(), faults = this.faults();
        if (this.recording === '' && state.past)
            picture.vertical(width * (this.zeroAt - from) / (to - from), this.looks.text, true);
        for (const {at} of faults)
            picture.vertical(width * (at - from) / (to - from), this.looks.bad);
        const key = this.labelKey(cssWidth, cssHeight, ratio);
        const labels = this.labels.has(key) ? [] : this.axisLabels(cssWidth, cssHeight);
        this.labels.put(picture, key, labels, this.looks.back, ratio);
        context.putImageData(picture.image, 0, 0);
        faults.forEach(({at, text}, i) => {
            const x = cssWidth * (at - from) / (to - from) + 4, y = 28 + 14 * (i % 4);
            const whole = `fault: ${text}`;
            const label = {text: fitted(context, whole, cssWidth - 8), x, y, paint: this.looks.bad};
            write(context, label, this.looks.back, cssWidth);
        });
        this.writeNotice(context, cssWidth, cssHeight);
        this.showXy(false);
    }

    writeNotice(context, width, height) {
        const notice = this.notice(), {back, bad} = this.looks, y = height / 2;
        if (notice === '') return;
        const font = '600 18px system-ui, sans-serif';
        context.font = font;
        const wide = context.measureText(notice).width, x = (width - wide) / 2;
        context.fillStyle = back;
        context.fillRect(x - 12, y - 22, wide + 24, 36);
        write(context, {text: notice, x, y: y + 2, paint: bad, font}, back, width);
    }

    /// What the ground of the picture depends on besides its size and colours.
    stopsKey() {
        if (this.stops.length === 0) return '';
        return [...this.range(), ...this.stops.flatMap(({from, to}) => [from, to])].join(' ');
    }

    /// What is behind the traces: the shaded times and the grid.
    drawGround() {
        const {picture} = this, {width, height} = this.canvas;
        this.drawStops();
        for (let i = 1; i < divisions; i++)
            picture.vertical(width * i / divisions, this.looks.grid);
        for (let i = 1; i < rows; i++)
            picture.horizontal(height / rows * i, this.looks.grid);
    }

    /// Shades the time in which the functions did not run.
    drawStops() {
        const {picture} = this, {width, height} = this.canvas, [from, to] = this.range();
        const column = time => Math.round(width * (time - from) / (to - from));
        for (const stop of this.stops) {
            const begin = Math.max(0, column(Math.max(stop.from, from))),
                  end = Math.min(width, column(Math.min(stop.to, to)));
            picture.fill(begin, end - begin, 0, height, picture.colour(this.looks.grid));
        }
    }

    /// The row of the zero line of a channel; null when it has none.
    zeroRow(channel) {
        if (!channel?.scale || channel.unknown) return null;
        return this.canvas.height * (.5 - channel.position / rows);
    }

    /// What is above the traces of a channel: the mark of its zero line, and the trigger.
    drawMarks(channel, i, thick, ratio) {
        const {picture, canvas} = this, row = this.zeroRow(channel);
        if (row !== null) {
            const from = Math.round(row) - thick, wide = Math.round(10 * ratio);
            picture.fill(0, wide, from, from + 2 * thick, picture.colour(paint(i)));
        }
        if (channel.name !== this.trigger || this.mode === 'roll' || !channel.scale) return;
        const {zero, perUnit} = this.linesOf(channel);
        picture.horizontal(zero - this.level * perUnit, paint(i), true);
        picture.vertical(canvas.width * this.zeroTime() / divisions, paint(i), true);
    }

    /// The indices of the channels in the order in which they are drawn: the selected one is above.
    order() {
        const all = [...this.channels.keys()].filter(i => this.channels[i].scale);
        return all.sort((a, b) => Number(a === this.selected) - Number(b === this.selected));
    }

    lineOf(i, thick) {
        return {name: paint(i), thick: i === this.selected ? 2 * thick : thick, dashed: i >= 8};
    }

    /// The row of the value 0 of a channel, and the rows of a unit.
    linesOf({position, scale}) {
        const {height} = this.canvas, dy = height / rows;
        return {zero: height / 2 - dy * position, perUnit: dy / scale};
    }

    /// Seconds of a column of pixels: a number that does not depend on the shown time.
    columnWidth() { return this.base * divisions / this.canvas.width; }

    /// Draws all traces by moving those of the last picture. Returns false when one of them has few
    /// samples, or none in this time.
    drawRolled(thick) {
        const {picture, store, channels, roll} = this, [from, to] = this.range();
        const shown = this.order().filter(i => store.place.has(channels[i].name));
        if (!shown.every(i => picture.isDense(store, channels[i].name, from, to))) {
            roll.forget();
            return false;
        }
        const each = this.columnWidth();
        const traces = shown.map(i => ({
            columns: store.columns(channels[i].name, each),
            ...this.linesOf(channels[i]),
            line: this.lineOf(i, thick)
        }));
        roll.put(picture, traces, Math.floor(from / each), this.behind());
        return true;
    }

    /// What each row has behind the traces: the grid, and the zero line of the selected channel.
    behind() {
        const {picture, canvas, looks} = this, zero = this.zeroRow(this.channels[this.selected]);
        const key = [canvas.height, picture.thick, looks.dark, zero].join(' ');
        if (this.rowColours?.key === key) return this.rowColours;
        const all = new Uint32Array(canvas.height).fill(picture.colour(looks.back)),
              isLine = new Uint8Array(canvas.height);
        for (let i = 1; i < rows; i++)
            all.fill(
                picture.colour(looks.grid), ...picture.rowsOf(canvas.height / rows * i));
        if (zero !== null) {
            all.fill(picture.colour(looks.dim), ...picture.rowsOf(zero));
            isLine.fill(1, ...picture.rowsOf(zero));
        }
        this.rowColours = {key, rows: all, isLine};
        return this.rowColours;
    }

    /// Draws all traces from their samples.
    drawAll(thick) {
        const {picture, channels} = this, [from, to] = this.range(), each = this.columnWidth();
        const zero = this.zeroRow(channels[this.selected]);
        if (zero !== null) picture.horizontal(zero, this.looks.dim);
        for (const i of this.order()) {
            const {zero: row, perUnit} = this.linesOf(channels[i]), {name} = channels[i];
            picture.trace(
                this.store, name, from, to, row, perUnit, this.lineOf(i, thick), each);
        }
    }

    /// The place of time 0, in divisions: the trigger, or the newest sample; outside of the picture
    /// when that was scrolled.
    zeroTime() {
        if (this.shownAt === null) return divisions;
        return Number(((this.zeroAt - this.range()[0]) / this.base).toFixed(6));
    }

    /// What the labels depend on: they are made again when it is another one.
    labelKey(width, height, ratio) {
        const channel = this.channels[this.selected], {base, looks, selected} = this;
        const own = channel && !channel.unknown ?
            [channel.name, channel.unit, channel.scale, channel.position] :
            [];
        const cursors = this.useCursors ? this.cursors : [];
        return [
            base, this.zeroTime(), selected, looks.dark, width, height, ratio,
            this.channels.length, ...own, ...cursors
        ].join(' ');
    }

    /// The numbers of the axes, the name of the selected channel, and those of the cursors.
    axisLabels(width, height) {
        const {dim, text: tone} = this.looks, channel = this.channels[this.selected];
        const every = Math.ceil(labelWidth * divisions / width);
        const all =
            timeLabels(this.base, divisions, this.zeroTime(), every)
                .map(
                    ({at, text}) =>
                        ({text, x: width * at / divisions + 4, y: height - 5, paint: dim}));
        if (channel?.scale && !channel.unknown) {
            const own = paint(this.selected), title = channelTitle(channel, this.channels);
            for (const {row, text} of isStack(this.channels) ? [] : valueLabels(channel, rows))
                all.push({text, x: 14, y: height * row / rows - 4, paint: own});
            all.push({text: title, x: 14, y: 14, paint: own});
        }
        if (this.useCursors)
            this.cursors.forEach(
                (at, i) => all.push({text: String(i + 1), x: width * at + 4, y: 14, paint: tone}));
        return all;
    }

    /// Chooses the scale of a new channel from its first values.
    chooseScale(channel) {
        if (channel.scale !== 0 || this.store.rows <= 20) return;
        const [from, to] = this.range(), seen = measure(this.store, channel.name, from, to);
        if (seen)
            channel.scale =
                nice(Math.max(seen.max - seen.min, Math.abs(seen.max), 1e-9) / (rows * .4));
    }

    draw() {
        text(this.stop, this.run ? 'Stop' : 'Run');
        this.stop.disabled = this.recording !== '' || state.past !== null;
        this.surface.request();
    }

    // ---- the table

    drawChannels() {
        const {channels} = this,
              names = channels.map(c => [c.name, c.name]);
        fill(
            this.triggerSource, [['', 'no trigger'], [faultSource(''), 'a fault'], ...names],
            isFaultSource(this.trigger) ? faultSource('') : this.trigger);
        fill(
            this.acrossSource, [['', 'no XY'], ...names.map(([v, t]) => [v, `XY over ${t}`])],
            this.across);
        this.acrossSource.disabled = channels.length === 0;
        this.drawTrigger();
        this.showXy();
        this.whole.hidden = channels.length === 0;
        this.table.replaceChildren(...channels.map((channel, i) => this.channelRow(channel, i)));
    }

    /// Shows the controls that the source of the trigger has.
    drawTrigger() {
        const isFault = isFaultSource(this.trigger);
        this.edges.hidden = this.levelLabel.hidden = isFault || this.trigger === '';
        this.faultsOf.hidden = !isFault;
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
        channel.cells =
            Array.from(columns.slice(2), ([, kind]) => h('td', {class: `${kind} mono`}, '–'));
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
              swatch, channel.name,
              channel.unknown ? h('span', {class: 'bad'}, ' unknown name') : '');
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
        // Each text that changes makes the browser lay out the table: once a second is enough.
        this.measurements++;
        if (!this.run || this.measurements % 2 === 1)
            this.channels.forEach(channel => this.measureChannel(channel));
        if (this.notice() !== '') this.surface.request();
        this.drawHistory();
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
            base: this.base,
            range: this.range(),
            notice: this.notice(),
            peak: this.measureSpectrum(),
            faults: this.faults(),
            xy: this.xyPane.element.hidden ? null : this.xyPane.pairs,
            stops: this.stops.map(({from, to}) => ({from, to: to === Infinity ? null : to}))
        };
        Object.assign(window, {halcyonScope: shownNow});  // for tests
    }

    measureChannel(channel) {
        if (!channel.cells) return;
        const {store, useCursors} = this, [from, to] = this.range();
        const times = this.cursors.map(at => from + (to - from) * at),
              [begin, end] = useCursors ? [...times].sort((a, b) => a - b) : [from, to];
        const seen = measure(store, channel.name, begin, end);
        const at =
            useCursors ? times.map(time => valueAt(store, channel.name, time)) : [null, null];
        const size = seen ? Math.max(Math.abs(seen.min), Math.abs(seen.max)) : 0;
        const known = seen && seen.frequency !== null,
              frequency = known ? `${shortened(seen.frequency)} Hz` : '?',
              difference = at.includes(null) ? null : at[1] - at[0];
        const figures = [
            ...this.stepCells(channel), seen?.min, seen?.max, rounded(seen?.mean, size), seen?.rms,
            seen?.deviation, frequency, ...at, difference
        ];
        figures.forEach((value, k) => text(channel.cells[k], shortened(value)));
        if (document.activeElement !== channel.input && channel.scale)
            channel.input.value = String(Number(channel.scale.toPrecision(3)));
    }

    /// The time of a step response: from cursor to cursor, or from the trigger to the end. Null:
    /// neither is there.
    stepRange() {
        const [from, to] = this.range(), length = to - from;
        if (this.useCursors) {
            const [first, last] = [...this.cursors].sort((a, b) => a - b);
            return [from + length * first, from + length * last];
        }
        return this.triggered ? [this.zeroAt, to] : null;
    }

    stepCells(channel) {
        const range = this.useSteps ? this.stepRange() : null;
        const found = range && stepResponse(this.store, channel.name, ...range);
        if (!found) return ['–', '–', '–'];
        const {rise, overshoot, settling} = found;
        return [
            rise === null ? '–' : seconds(rise), `${shortened(overshoot)} %`,
            settling === null ? 'not settled' : seconds(settling)
        ];
    }

    statusText() {
        if (this.channels.length === 0) return 'Add a channel: a pin, signal or parameter';
        if (this.source === '') return 'no samples yet';
        const {store} = this, parts = [this.source, `${store.rows} rows`, `${store.lost} lost`];
        if (!this.run && this.recording === '' && !state.past)
            parts.push(this.single ? 'single record' : 'stopped');
        if (this.channels.some(one => store.isCoarse(one.name, this.range()[0])))
            parts.push(`minima and maxima of ${seconds(store.pastWidth)}`);
        const late = performance.now() - this.lastTrigger > 1000;
        if (this.mode !== 'roll' && this.trigger && this.run && late)
            parts.push('waiting for trigger');
        if (this.useSteps && this.stepRange() === null)
            parts.push('step: put cursor 1 at the step and cursor 2 where it has settled');
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
            const across = event.shiftKey ? event.deltaY || event.deltaX : event.deltaX;
            if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY))
                this.scroll(Math.sign(across) * .5);
            else
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
        this.dragging = this.useCursors ? nearest : 'press';
        this.canvas.setPointerCapture(event.pointerId);
    }

    dragged(event) {
        if (this.dragging === null) return;
        const channel = this.channels[this.selected], {movementX, movementY} = event;
        if (this.dragging === 'press' && (movementX !== 0 || movementY !== 0))
            this.dragging = Math.abs(movementX) > Math.abs(movementY) ? 'scroll' : 'move';
        if (this.dragging === 'scroll')
            this.scroll(-movementX * divisions / this.canvas.clientWidth);
        else if (typeof this.dragging === 'number')
            this.cursors[this.dragging] =
                Math.min(1, Math.max(0, event.offsetX / this.canvas.clientWidth));
        else if (channel)
            channel.position -= movementY * rows / this.canvas.clientHeight;
        this.surface.request();
    }

    shiftBase(by) {
        const index = steps.findIndex(s => s >= this.base) + by;
        this.base = steps[Math.min(steps.length - 1, Math.max(0, index))];
        this.timeBase.value = String(this.base);
        this.save();
        if (state.past) this.followMoment();
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
        else if (key in pages)
            this.scroll(pages[key]);
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
