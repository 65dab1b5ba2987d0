// SPDX-License-Identifier: MIT
// Threads with their histograms, missed periods, faults, privileges.
import {on, request, state} from './link.js';
import {colour, duration, h, number, surface, text} from './dom.js';

/** @type {[string, (thread: any) => string][]} */
const figures = [
    ['period', t => duration(t.period_ns)], ['cycles', t => number(t.cycles)],
    ['missed', t => number(t.missed)], ['overruns', t => number(t.overruns)],
    ['load', t => `${(100 * t.busy_p50_ns / t.period_ns).toPrecision(2)} %`],
    ['page faults', t => number(t.page_faults)]
];
const times = [['wake-up latency', 'wakeup'], ['execution time', 'busy']],
      quantiles = ['p50', 'p99', 'max'];

/// Draws two distributions over a logarithmic axis, one above the other.
function drawHistograms(context, width, height, histograms, period) {
    const left = 4, right = width - 4, low = 2, high = Math.log10(Math.max(period * 4, 1e6));
    const x = ns => left + (right - left) * (Math.log10(Math.max(ns, 100)) - low) / (high - low);
    context.font = '11px system-ui, sans-serif';
    const parts = [['wakeup', 'wake-up latency', '--accent'], ['busy', 'execution time', '--good']],
          each = (height - 16) / 2;
    for (let e = low; e <= high; e++) {
        context.fillStyle = colour('--grid');
        context.fillRect(x(10 ** e), 0, 1, height - 14);
        context.fillStyle = colour('--dim');
        const label = duration(10 ** e), wide = context.measureText(label).width;
        context.fillText(
            label, Math.min(Math.max(x(10 ** e) - wide / 2, 0), width - wide), height - 3);
    }
    parts.forEach(([name, title, paint], row) => {
        const pairs = histograms?.[name] ?? [], base = (row + 1) * each - 2;
        let most = 1;
        for (let i = 0; i < pairs.length; i += 2)
            most = Math.max(most, pairs[i + 1]);
        context.fillStyle = colour(paint);
        for (let i = 0; i < pairs.length; i += 2) {
            const begin = x(pairs[i]), end = x(pairs[i] < 8 ? pairs[i] + 1 : pairs[i] * 1.125);
            const tall = (each - 16) * Math.log1p(pairs[i + 1]) /
                Math.log1p(most);  // a single late cycle stays visible
            context.fillRect(begin, base - tall, Math.max(end - begin - .5, 1), tall);
        }
        context.fillStyle = colour('--dim');
        context.fillText(title, left, base - each + 13);
    });
    context.fillStyle = colour('--bad');
    context.fillRect(x(period), 0, 1.5, height - 14);
    context.textAlign = x(period) > width - 60 ? 'right' : 'left';
    context.fillText('period', x(period) + (x(period) > width - 60 ? -4 : 5), 11);
    context.textAlign = 'left';
}

function stateOf(thread) {
    if (thread.hung)
        return [
            `hangs${thread.function ? ` in ${thread.function}` : ''}, no cycle for ${
                duration(thread.silent_ns)}`,
            'bad'
        ];
    if (thread.faulted) return ['stopped by a fault', 'bad'];
    if (!state.running) return ['stopped: functions do not run', 'warn'];
    if (thread.missed > 0)
        return [
            `running; ${thread.missed} ${thread.missed === 1 ? 'period' : 'periods'} missed`, 'warn'
        ];
    return ['running, no period missed', 'good'];
}

/** The card of a thread: figures, histograms, its scheduling. */
class ThreadCard {
    constructor(thread) {
        this.thread = thread;
        this.histograms = null;
        this.values = figures.map(() => h('dd'));
        this.times = times.map(() => quantiles.map(() => h('td', {class: 'n'})));
        this.state = h('p');
        this.policy = h('p', {class: 'dim'});
        const canvas = h('canvas', {
            role: 'img',
            'aria-label':
                `Histograms of thread ${thread.name}; the figures are in the table above`
        });
        canvas.style.height = '150px';
        this.element = h(
            'section', {class: 'card', 'data-thread': thread.name},
            h('h2', {}, `Thread ${thread.name}`), this.state,
            h('dl', {class: 'figures'},
              figures.map(([name], i) => [h('dt', {}, name), this.values[i]])), this.timeTable(),
            canvas, this.policy);
        this.surface = surface(
            canvas,
            (context, width, height) => drawHistograms(
                context, width, height, this.histograms, this.thread.period_ns));
    }

    end() {
        this.element.remove();
        this.surface.end();
    }

    timeTable() {
        const titles = quantiles.map(name => h('th', {class: 'n'}, name));
        const rows = times.map(([name], i) => h('tr', {}, h('td', {}, name), this.times[i]));
        return h(
            'table', {class: 'times'}, h('thead', {}, h('tr', {}, h('th'), titles)),
            h('tbody', {}, rows));
    }

    update(thread, histograms) {
        this.thread = thread;
        this.histograms = histograms;
        figures.forEach(([, of], i) => text(this.values[i], of(thread)));
        times.forEach(
            ([, of], i) => quantiles.forEach(
                (name, k) => text(this.times[i][k], duration(thread[`${of}_${name}_ns`]))));
        const [words, kind] = stateOf(thread);
        text(this.state, words);
        this.state.className = kind;
        this.showPolicy();
        this.surface.request();
    }

    showPolicy() {
        const {policy, cpu} = this.thread, unprivileged = /no privilege/.test(policy);
        text(
            this.policy,
            `${policy}${cpu >= 0 ? `, CPU ${cpu}` : ''}${
                unprivileged ? `. To grant real-time priority, type: ${state.hal} doctor` : ''}`);
        this.policy.className = unprivileged ? 'warn' : 'dim';
    }
}

const faultElement = row =>
    h('li', {class: 'bad'}, `${row.sentence}${row.count > 1 ? ` (${row.count} times)` : ''} `,
      h('span', {class: 'dim'}, `${duration(row.age_ns)} ago`));

function summaryOf(threads) {
    const count = `${threads.length} thread${threads.length === 1 ? '' : 's'}`,
          leader = threads[0]?.clock_leader;
    return `${state.instance}, Halcyon ${state.version}, process ${state.pid}; ${count}` +
        (leader ? `, synchronised to ${leader}` : '');
}

/** The view of threads and faults. */
export class View {
    /** @param {HTMLElement} main */
    constructor(main) {
        this.cards = h('div', {class: 'cards'});
        this.faults = h('ul', {class: 'plain'});
        this.summary = h('p', {class: 'dim'});
        this.clear = h('button', {onclick: () => this.acknowledge()}, 'Acknowledge faults');
        const faultCard =
            h('section', {class: 'card wide'}, h('h2', {}, 'Faults'), this.faults, this.clear);
        main.append(this.summary, h('div', {class: 'cards first'}, faultCard), this.cards);
        /** @type {Map<string, ThreadCard>} */
        this.known = new Map();
        this.busy = false;
        this.open = true;
        this.readAll();
        this.timer = setInterval(() => this.readAll(), 500);
        this.unsubscribe = on('machine', () => this.readAll());
    }

    end() {
        this.open = false;
        clearInterval(this.timer);
        this.unsubscribe();
        this.known.forEach(card => card.surface.end());
    }

    async acknowledge() {
        await request({run: ['fault', 'clear']});
        await this.readFaults();
    }

    async readFaults() {
        const reply = await request({run: ['show', 'fault']});
        if (!reply.ok || !this.open) return;
        let rows = [];
        try {
            rows = JSON.parse(reply.out);
        } catch {
            return;
        }
        this.faults.replaceChildren(...rows.slice(-20).reverse().map(faultElement));
        if (rows.length === 0) this.faults.append(h('li', {class: 'good'}, 'No faults'));
        this.clear.hidden = rows.length === 0 || !state.held;
    }

    async readAll() {
        if (this.busy || !state.machine) return;
        this.busy = true;
        const reply = await request({describe: 'thread', histograms: true});
        this.busy = false;
        if (!this.open) return;
        if (reply.ok) this.showThreads(reply.objects, reply.histograms ?? {});
        await this.readFaults();
    }

    showThreads(threads, histograms) {
        const names = new Set(threads.map(thread => thread.name));
        for (const [name, card] of this.known) {
            if (names.has(name)) continue;
            card.end();
            this.known.delete(name);
        }
        for (const thread of threads) {
            if (!this.known.has(thread.name)) {
                const card = new ThreadCard(thread);
                this.known.set(thread.name, card);
                this.cards.append(card.element);
            }
            this.known.get(thread.name).update(thread, histograms[thread.name]);
        }
        text(this.summary, summaryOf(threads));
    }
}
