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

function threadCard(thread) {
    const card = {thread, histograms: null};
    card.values = figures.map(() => h('dd'));
    card.times = times.map(() => quantiles.map(() => h('td', {class: 'n'})));
    card.state = h('p');
    card.policy = h('p', {class: 'dim'});
    const canvas = h('canvas', {
        role: 'img',
        'aria-label': `Histograms of thread ${thread.name}; the figures are in the table above`
    });
    canvas.style.height = '150px';
    card.element = h(
        'section', {class: 'card', 'data-thread': thread.name},
        h('h2', {}, `Thread ${thread.name}`), card.state,
        h('dl', {class: 'figures'},
          figures.map(([name], i) => [h('dt', {}, name), card.values[i]])),
        h('table', {class: 'times'},
          h('thead', {}, h('tr', {}, h('th'), quantiles.map(name => h('th', {class: 'n'}, name)))),
          h('tbody', {}, times.map(([name], i) => h('tr', {}, h('td', {}, name), card.times[i])))),
        canvas, card.policy);
    card.surface = surface(
        canvas,
        (context, width, height) =>
            drawHistograms(context, width, height, card.histograms, card.thread.period_ns));
    return card;
}

function stateOf(thread) {
    if (thread.hung)
        return [
            `hangs${thread.function ? ` in ${thread.function}` : ''}, no cycle for ${
                duration(thread.silent_ns)}`,
            'bad'
        ];
    if (thread.faulted) return ['stopped by a fault', 'bad'];
    if (thread.missed > 0) return [`running; ${thread.missed} periods missed`, 'warn'];
    return ['running, no period missed', 'good'];
}

function update(card, thread, histograms) {
    card.thread = thread;
    card.histograms = histograms;
    figures.forEach(([, of], i) => text(card.values[i], of(thread)));
    times.forEach(
        ([, of], i) => quantiles.forEach(
            (name, k) => text(card.times[i][k], duration(thread[`${of}_${name}_ns`]))));
    const [words, kind] = stateOf(thread);
    text(card.state, words);
    card.state.className = kind;
    const unprivileged = /no privilege/.test(thread.policy);
    text(
        card.policy,
        `${thread.policy}${thread.cpu >= 0 ? `, CPU ${thread.cpu}` : ''}${
            unprivileged ? '. To grant real-time priority, see: hal doctor' : ''}`);
    card.policy.className = unprivileged ? 'warn' : 'dim';
    card.surface.request();
}

export function show(main) {
    const cards = h('div', {class: 'cards'}), faults = h('ul', {class: 'plain'}),
          summary = h('p', {class: 'dim'});
    const clear =
        h('button', {onclick: () => request({run: ['fault', 'clear']}).then(faultsNow)},
          'Acknowledge faults');
    const faultCard = h('section', {class: 'card wide'}, h('h2', {}, 'Faults'), faults, clear);
    main.append(summary, h('div', {class: 'cards first'}, faultCard), cards);
    const known = new Map();
    let busy = false, open = true;

    async function faultsNow() {
        const reply = await request({run: ['show', 'fault']});
        if (!reply.ok || !open) return;
        let rows = [];
        try {
            rows = JSON.parse(reply.out);
        } catch {
            return;
        }
        faults.replaceChildren(
            ...(rows.length === 0 ?
                    [h('li', {class: 'good'}, 'No faults')] :
                    rows.slice(-20).reverse().map(
                        row =>
                            h('li', {class: 'bad'},
                              `${row.sentence}${row.count > 1 ? ` (${row.count} times)` : ''} `,
                              h('span', {class: 'dim'}, `${duration(row.age_ns)} ago`)))));
        clear.hidden = rows.length === 0 || !state.held;
    }

    async function now() {
        if (busy || !state.machine) return;
        busy = true;
        const reply = await request({describe: 'thread', histograms: true});
        busy = false;
        if (!open) return;
        if (reply.ok) {
            const names = new Set(reply.objects.map(thread => thread.name));
            for (const [name, card] of known)
                if (!names.has(name)) {
                    card.element.remove();
                    card.surface.end();
                    known.delete(name);
                }
            for (const thread of reply.objects) {
                if (!known.has(thread.name)) {
                    known.set(thread.name, threadCard(thread));
                    cards.append(known.get(thread.name).element);
                }
                update(known.get(thread.name), thread, reply.histograms?.[thread.name]);
            }
            text(
                summary,
                `${state.instance}, Halcyon ${state.version}, process ${state.pid}; ${
                    reply.objects.length} thread${reply.objects.length === 1 ? '' : 's'}` +
                    (reply.objects[0]?.clock_leader ?
                         `, synchronised to ${reply.objects[0].clock_leader}` :
                         ''));
        }
        await faultsNow();
    }
    now();
    const timer = setInterval(now, 500), end = on('machine', now);
    return () => {
        open = false;
        clearInterval(timer);
        end();
        known.forEach(card => card.surface.end());
    };
}
