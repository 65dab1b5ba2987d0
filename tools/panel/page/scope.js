// SPDX-License-Identifier: MIT
// The scope: up to 16 channels, time base, trigger, cursors, measurements. Samples come from a
// probe, every cycle of their threads; from a machine without probes, by subscription.
import {on, probe, subscribe} from './link.js';
import {colour, dark, h, number, surface, text} from './dom.js';
import {objects} from './objects.js';
import {Store, Trigger, measure, valueAt} from './scope_data.js';
import {Picture} from './scope_picture.js';
import {remember} from './place.js';

const most = 16, divisions = 10, rows = 8, before = .2;
const hues = [210, 30, 130, 350, 270, 175, 60, 310];
const paint = i => `hsl(${hues[i % 8]} ${dark.matches ? '85% 68%' : '80% 36%'})`;
const steps = [1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, .01, .02, .05, .1, .2, .5, 1, 2];
const seconds = s => s < 1e-3 ? `${Number((s * 1e6).toPrecision(4))} µs` :
    s < 1 ? `${Number((s * 1e3).toPrecision(4))} ms` :
            `${Number(s.toPrecision(4))} s`;
const nice = size => {
    const e = 10 ** Math.floor(Math.log10(size));
    return e * (size / e <= 1 ? 1 : size / e <= 2 ? 2 : size / e <= 5 ? 5 : 10);
};

export function show(main, query) {
    // ch=name:units per division:position,…
    let channels =
        (query.get('ch') ?? '').split(',').filter(word => word).slice(0, most).map(word => {
            const [name, scale, position] = word.split(':');
            return {name, scale: Number(scale) || 0, position: Number(position) || 0};
        });
    let base = Number(query.get('base')) || .1, mode = query.get('mode') || 'roll', run = true,
        end = null, source = '', shownAt = null, single = false, lastTrigger = 0;
    let [trigger, edge, level] = [
        query.get('trigger') ?? '', query.get('edge') ?? 'rising', Number(query.get('level')) || 0
    ];
    const store = new Store(), cursors = [.3, .7];
    let watcher = null, pending = null, useCursors = query.get('cursors') === '1', selected = 0,
        frames = 0, drawn = 0, since = performance.now(), looks = {};

    const add = h('input', {
        type: 'search',
        list: 'scope-names',
        placeholder: 'Add a channel',
        'aria-label': 'Add a channel'
    }),
          names = h('datalist', {id: 'scope-names'});
    const choose = (label, values, value, act) => {
        const select =
            h('select', {'aria-label': label, onchange: () => act(select.value)},
              values.map(([v, t]) => h('option', {value: v}, t)));
        select.value = String(value);
        return select;
    };
    const timeBase = choose(
        'Time per division', steps.map(s => [String(s), `${seconds(s)}/div`]), base, value => {
            base = Number(value);
            save();
        });
    const modes = choose(
        'Mode', [['roll', 'Roll'], ['auto', 'Auto'], ['normal', 'Normal'], ['single', 'Single']],
        mode, value => {
            mode = value;
            single = false;
            shownAt = null;
            run = true;
            save();
        });
    const triggerSource = choose('Trigger channel', [['', 'no trigger']], '', value => {
        trigger = value;
        save();
        arm();
    });
    const edges = choose(
        'Edge', [['rising', 'rising'], ['falling', 'falling'], ['either', 'either edge']], edge,
        value => {
            edge = value;
            save();
            arm();
        });
    const levelInput = h('input', {
        size: 7,
        inputmode: 'decimal',
        'aria-label': 'Trigger level',
        value: String(level),
        onchange: () => {
            level = Number(levelInput.value) || 0;
            save();
            arm();
        }
    });
    const stop =
        h('button', {
            class: 'main',
            onclick: () => {
                run = !run;
                single = false;
                draw();
            }
        },
          'Stop');
    const cursorButton =
        h('button', {
            'aria-pressed': String(useCursors),
            onclick: () => {
                useCursors = !useCursors;
                cursorButton.setAttribute('aria-pressed', useCursors);
                showCursors();
                save();
            }
        },
          'Cursors');
    const status = h('span', {class: 'dim', id: 'scope-status'}), table = h('tbody');
    const canvas = h('canvas', {
        tabindex: 0,
        role: 'img',
        'aria-label':
            'Traces; the measurements are in the table below. Space runs and stops, left and right change the time base, up and down move the channel, plus and minus scale it, a scales all.'
    });
    const titles = [
        'Channel', 'units/div', 'min', 'max', 'mean', 'rms', 'frequency', 'cursor 1', 'cursor 2',
        'Δ'
    ];
    const whole =
        h('table', {class: 'channels'},
          h('thead', {},
            h('tr', {},
              titles.map(
                  (t, i) =>
                      h('th',
                        {class: i < 2 ? '' :
                             i < 7    ? 'n' :
                                        'n cursor'},
                        t)),
              h('th', {}, h('span', {class: 'unseen'}, 'Remove')))),
          table);
    const showCursors = () => whole.classList.toggle('no-cursors', !useCursors);
    main.append(
        h('div', {class: 'column'},
          h('div', {class: 'bar'}, add, names, timeBase, modes, triggerSource, edges,
            h('label', {class: 'tied'}, 'at', levelInput), stop,
            h('button', {onclick: autoscale}, 'Auto scale'), cursorButton, status),
          h('div', {class: 'fill high'}, canvas), h('div', {class: 'scroll'}, whole)));

    function save() {
        remember({
            ch: channels.map(c => `${c.name}:${c.scale}:${c.position}`).join(','),
            base,
            mode,
            trigger,
            edge,
            level,
            cursors: useCursors ? '1' : ''
        });
        draw();
    }
    function arm() {
        watcher = trigger ? new Trigger(trigger, edge, level) : null;
        pending = null;
    }
    function follow() {
        if (end) end();
        end = null;
        store.clear();
        const list = channels.map(channel => channel.name);
        if (list.length === 0) return;
        let known = 0;
        end = probe(
            list, {batch_ms: 15},
            (event, bytes, layout) => {
                if (layout.layout !== known) {
                    known = layout.layout;
                    store.layout(layout.groups, list);
                    arm();
                }
                source = 'every cycle';
                store.samples(event, bytes, layout);
                take();
            },
            () => {  // a machine without probes
                source = 'sampled every 10 ms';
                store.layout([{columns: list.map((_, i) => i)}], list);
                arm();
                end = subscribe(list, 10, (values, event) => {
                    store.values(event);
                    take();
                });
            });
    }
    /// New samples are there: looks for triggers and decides which record is shown.
    function take() {
        if (!run) return;
        if (mode === 'roll' || !watcher) {
            shownAt = store.newest;
            watcher?.scan(store);
            return drawing.request();
        }
        const window = base * divisions, after = window * (1 - before);
        for (const time of watcher.scan(store))
            if (pending === null && (shownAt === null || time > shownAt) &&
                time - window * before >= 0)
                pending = time;
        if (pending !== null && store.newest >= pending + after) {
            shownAt = pending + after;
            lastTrigger = performance.now();
            pending = null;
            if (mode === 'single') {
                run = false;
                single = true;
                draw();
            }
        } else if (
            mode === 'auto' && performance.now() - lastTrigger > Math.max(window * 1000, 300))
            shownAt = store.newest;
        drawing.request();
    }
    function autoscale() {
        const [from, to] = range();
        const seen = channels.map(channel => measure(store, channel.name, from, to)),
              each = rows / Math.max(channels.length, 1);
        channels.forEach((channel, i) => {
            if (!seen[i]) return;
            const span = Math.max(seen[i].max - seen[i].min, Math.abs(seen[i].max) * 1e-3, 1e-9),
                  room = channels.length > 3 ? Math.max(each, 1) : rows;
            channel.scale = nice(span / (room * .85));
            const middle = (seen[i].max + seen[i].min) / 2,
                  place = channels.length > 3 ? rows / 2 - each * (i + .5) : 0;
            channel.position = Number((place - middle / channel.scale).toFixed(2));
        });
        save();
    }
    const range = () => {
        const to = shownAt ?? store.newest;
        return [to - base * divisions, to];
    };

    const picture = new Picture();
    const drawing = surface(canvas, (context, cssWidth, cssHeight, ratio) => {
        frames++;
        const [from, to] = range(), {width, height} = canvas, dy = height / rows,
                     thick = Math.max(1, Math.round(ratio));
        if (looks.dark !== dark.matches)
            looks = {
                dark: dark.matches,
                back: colour('--card'),
                grid: colour('--grid'),
                text: colour('--text')
            };
        picture.begin(width, height, thick, looks.back);
        for (let i = 1; i < divisions; i++)
            picture.vertical(width * i / divisions, looks.grid);
        for (let i = 1; i < rows; i++)
            picture.horizontal(dy * i, looks.grid);
        channels.forEach((channel, i) => {
            if (channel.scale === 0 && store.rows > 20) {
                const seen = measure(store, channel.name, from, to);
                if (seen) {
                    channel.scale =
                        nice(Math.max(seen.max - seen.min, Math.abs(seen.max), 1e-9) / (rows * .4));
                }
            }
            if (channel.scale === 0 || i === selected) return;
            drawChannel(channel, i, from, to, height, dy, thick);
        });
        if (channels[selected]?.scale)
            drawChannel(
                channels[selected], selected, from, to, height, dy,
                2 * thick);  // the selected one is on top
        if (useCursors)
            for (const at of cursors)
                picture.vertical(width * at, looks.text);
        context.putImageData(picture.image, 0, 0);
        if (useCursors) {
            context.fillStyle = looks.text;
            context.font = '12px system-ui, sans-serif';
            cursors.forEach(
                (at, i) => context.fillText(
                    String(i + 1), Math.min(cssWidth * at + 4, cssWidth - 10), 12));
        }
    }, true);
    function drawChannel(channel, i, from, to, height, dy, thick) {
        const zero = height / 2 - dy * channel.position, perUnit = dy / channel.scale;
        picture.trace(
            store, channel.name, from, to, zero, perUnit, {name: paint(i), thick, dashed: i >= 8});
        if (channel.name !== trigger || mode === 'roll') return;
        picture.horizontal(zero - level * perUnit, paint(i), true);
        picture.vertical(canvas.width * before, paint(i), true);
    }
    function draw() {
        text(stop, run ? 'Stop' : 'Run');
        drawing.request();
    }
    function drawChannels() {
        triggerSource.replaceChildren(
            ...[['', 'no trigger'], ...channels.map(c => [c.name, c.name])].map(
                ([v, t]) => h('option', {value: v}, t)));
        triggerSource.value = channels.some(c => c.name === trigger) ? trigger : '';
        whole.hidden = channels.length === 0;
        table.replaceChildren(...channels.map((channel, i) => {
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
                    save();
                }
            });
            channel.cells = Array.from(
                {length: 8}, (_, k) => h('td', {class: k < 5 ? 'n mono' : 'n mono cursor'}, '–'));
            return h(
                'tr', {'data-channel': channel.name},
                h('td', {},
                  h('button', {
                      class: 'plain mono',
                      'aria-pressed': String(i === selected),
                      onclick: () => {
                          selected = i;
                          drawChannels();
                          draw();
                      }
                  },
                    swatch, channel.name)),
                h('td', {}, channel.input), channel.cells,
                h('td', {},
                  h('button', {
                      class: 'plain',
                      'aria-label': `remove ${channel.name}`,
                      onclick: () => {
                          channels = channels.filter(c => c !== channel);
                          selected = 0;
                          save();
                          drawChannels();
                          follow();
                      }
                  },
                    '×')));
        }));
    }
    const measuring = setInterval(() => {
        const [from, to] = range(),
                     cut = useCursors ?
            cursors.map(at => from + (to - from) * at).sort((a, b) => a - b) :
            [from, to];
        channels.forEach(channel => {
            const seen = measure(store, channel.name, ...cut);
            if (!channel.cells) return;
            const at = useCursors ?
                cursors.map(c => valueAt(store, channel.name, from + (to - from) * c)) :
                [null, null];
            const all = [
                seen?.min, seen?.max, seen?.mean, seen?.rms,
                seen?.frequency === null || !seen ?
                    '?' :
                    `${number(Number(seen.frequency.toPrecision(5)))} Hz`,
                ...at, at[0] === null || at[1] === null ? null : at[1] - at[0]
            ];
            all.forEach(
                (value, k) => text(
                    channel.cells[k],
                    typeof value === 'number' ? number(Number(value.toPrecision(5))) :
                                                value ?? '–'));
            if (document.activeElement !== channel.input && channel.scale)
                channel.input.value = String(Number(channel.scale.toPrecision(3)));
        });
        const now = performance.now(), fps = frames * 1000 / (now - since);
        drawn += frames;
        frames = 0;
        since = now;
        text(
            status,
            channels.length === 0 ?
                'Add a channel: a pin, signal or parameter' :
                `${source}, ${store.rows} rows, ${store.lost} lost${
                    run        ? '' :
                        single ? ', single record' :
                                 ', stopped'}${
                    mode !== 'roll' && trigger && run && performance.now() - lastTrigger > 1000 ?
                        ', waiting for trigger' :
                        ''}${
                    useCursors ?
                        `, Δt ${seconds(Math.abs(cursors[1] - cursors[0]) * base * divisions)}` :
                        ''}`);
        const shownNow = {
            rows: store.rows,
            lost: store.lost,
            gaps: store.gaps,
            fps,
            frames: drawn,
            shownAt,
            lastTrigger,
            pre: base * divisions * before,
            store,
            range: range()
        };
        Object.assign(window, {halcyonScope: shownNow});  // for tests
    }, 500);

    let dragging = null;
    canvas.addEventListener('pointerdown', event => {
        const at = event.offsetX / canvas.clientWidth;
        dragging =
            useCursors ? (Math.abs(at - cursors[0]) < Math.abs(at - cursors[1]) ? 0 : 1) : 'move';
        canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener('pointermove', event => {
        if (dragging === null) return;
        if (dragging === 'move') {
            if (channels[selected])
                channels[selected].position -= event.movementY * rows / canvas.clientHeight;
        } else
            cursors[dragging] = Math.min(1, Math.max(0, event.offsetX / canvas.clientWidth));
        drawing.request();
    });
    canvas.addEventListener('pointerup', () => {
        if (dragging === 'move') save();
        dragging = null;
    });
    const shiftBase = by => {
        base = steps[Math.min(steps.length - 1, Math.max(0, steps.findIndex(s => s >= base) + by))];
        timeBase.value = String(base);
        save();
    };
    canvas.addEventListener('wheel', event => {
        event.preventDefault();
        shiftBase(Math.sign(event.deltaY));
    }, {passive: false});
    canvas.addEventListener('keydown', event => {
        const channel = channels[selected], key = event.key;
        if (key === ' ')
            stop.click();
        else if (key === 'ArrowLeft' || key === 'ArrowRight') {
            if (useCursors)
                cursors[event.ctrlKey ? 1 : 0] +=
                    (key === 'ArrowLeft' ? -1 : 1) * (event.shiftKey ? .01 : .001);
            else
                shiftBase(key === 'ArrowLeft' ? -1 : 1);
        } else if ((key === 'ArrowUp' || key === 'ArrowDown') && channel)
            channel.position += (key === 'ArrowUp' ? 1 : -1) * (event.shiftKey ? 1 : .1);
        else if ((key === '+' || key === '-') && channel)
            channel.scale = nice(channel.scale * (key === '+' ? .45 : 1.9));
        else if (key === 'a')
            autoscale();
        else if (key >= '1' && key <= '9' && channels[key - 1]) {
            selected = key - 1;
            drawChannels();
        } else
            return;
        event.preventDefault();
        save();
    });
    add.addEventListener('change', () => {
        const name = add.value.trim();
        if (name === '' || channels.length >= most ||
            channels.some(channel => channel.name === name))
            return;
        channels.push({name, scale: 0, position: 0});
        add.value = '';
        save();
        drawChannels();
        follow();
    });
    const load = async () => {
        const all = await objects();
        names.replaceChildren(
            ...[...all.values()].slice(0, 3000).map(o => h('option', {value: o.name})));
    };
    load();
    showCursors();
    drawChannels();
    dark.addEventListener('change', drawChannels);
    arm();
    follow();
    const ends = [on('machine', () => {
        shownAt = null;
        load();
    })];
    return () => {
        clearInterval(measuring);
        dark.removeEventListener('change', drawChannels);
        ends.forEach(one => one());
        if (end) end();
        drawing.end();
    };
}
