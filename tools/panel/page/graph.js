// SPDX-License-Identifier: MIT
// The netlist as a drawing with live values: pan, zoom, search, neighbourhood, groups; a click on a
// pin shows its writer and readers.
import {on, request, subscribe} from './link.js';
import {colour, h, number, surface, text, typeColour} from './dom.js';
import {objects} from './objects.js';
import {layered} from './layout.js';
import {remember} from './place.js';

const line = 17, head = 24, font = '12px system-ui, "DejaVu Sans", sans-serif', most = 400;

/// The name of the box that a pin belongs to: its instance, or with groups its component.
const owner = (pin, grouped) => grouped ? pin.component ?? pin.name.split('.')[0] :
                                          pin.instance ?? pin.component ?? pin.name.split('.')[0];

/// Builds boxes with ports and edges from the linked pins.
function build(all, grouped, collapsed) {
    const boxes = new Map(), edges = [];
    const box = name => {
        if (!boxes.has(name))
            boxes.set(name, {id: name, inputs: [], outputs: [], threads: new Set()});
        return boxes.get(name);
    };
    const signals = [...all.entries()]
                        .filter(([name, object]) => object.kind === 'sig' && object.name === name)
                        .map(([, object]) => object);
    for (const signal of signals) {
        const pins = signal.pins.map(name => all.get(name)).filter(pin => pin),
              writer = pins.find(pin => pin.name === signal.writer) ??
            pins.find(pin => pin.dir === 'I/O');
        for (const pin of pins) {
            const at = box(owner(pin, grouped));
            if (pin.thread) at.threads.add(pin.thread);
            (pin === writer ? at.outputs : at.inputs).push(pin);
        }
        if (writer)
            for (const pin of pins)
                if (pin !== writer)
                    edges.push({
                        signal,
                        writer,
                        pin,
                        from: owner(writer, grouped),
                        to: owner(pin, grouped),
                        out: 0,  // of the ports, from the top of their boxes
                        in : 0
                    });
    }
    const measure = document.createElement('canvas').getContext('2d');
    measure.font = font;
    const short = (pin, id) =>
        pin.name.startsWith(id + '.') ? pin.name.slice(id.length + 1) : pin.name;
    for (const one of boxes.values()) {
        one.collapsed = collapsed.has(one.id);
        const wide = pins =>
            Math.max(0, ...pins.map(pin => measure.measureText(short(pin, one.id)).width));
        one.width = one.collapsed ? measure.measureText(one.id).width + 36 :
                                    Math.max(
                                        wide(one.inputs) + wide(one.outputs) + 34,
                                        measure.measureText(one.id).width + 36, 90);
        one.height = one.collapsed ?
            head :
            head + line * Math.max(one.inputs.length, one.outputs.length) + 4;
        one.ports = new Map();
        for (const list of [one.inputs, one.outputs])
            list.forEach((pin, i) => one.ports.set(pin.name, {
                pin,
                label: short(pin, one.id),
                y: one.collapsed ? head / 2 : head + line * (i + .5),
                input: list === one.inputs
            }));
    }
    for (const edge of edges) {
        edge.out = boxes.get(edge.from).ports.get(edge.writer.name).y;
        edge.in = boxes.get(edge.to).ports.get(edge.pin.name).y;
    }
    return {boxes: [...boxes.values()], edges};
}

/// Keeps what is at most `depth` edges from a box whose name or a pin of which is `around`.
function neighbourhood({boxes, edges}, around, depth) {
    let near = new Set(boxes
                           .filter(
                               one => one.id === around || one.ports.has(around) ||
                                   [...one.ports.values()].some(port => port.pin.signal === around))
                           .map(one => one.id));
    if (near.size === 0) return {boxes, edges};
    for (let i = 0; i < depth; i++) {
        const wider = new Set(near);
        for (const edge of edges) {
            if (near.has(edge.from)) wider.add(edge.to);
            if (near.has(edge.to)) wider.add(edge.from);
        }
        near = wider;
    }
    return {
        boxes: boxes.filter(one => near.has(one.id)),
        edges: edges.filter(edge => near.has(edge.from) && near.has(edge.to))
    };
}

export function show(main, query) {
    const view = {x: 0, y: 0, scale: 1, fitted: false, moved: false, size: ''};
    let all = new Map(), graph = {boxes: [], edges: []}, size = {width: 1, height: 1},
        values = new Map(), end = null, open = true, selected = query.get('pin') ?? '';
    const collapsed = new Set((query.get('collapsed') ?? '').split(',').filter(name => name));
    const search = h('input', {
        type: 'search',
        class: 'grow',
        list: 'graph-names',
        placeholder: 'Search pins, signals, instances',
        'aria-label': 'Search',
        value: query.get('around') ?? ''
    });
    const names = h('datalist', {id: 'graph-names'});
    const depth = h('select', {'aria-label': 'Depth'}, [
        ['', 'whole netlist'], ['1', '1 step around'], ['2', '2 steps around'],
        ['3', '3 steps around']
    ].map(([value, label]) => h('option', {value}, label)));
    depth.value = query.get('depth') ?? '';
    const grouped =
        h('button', {
            'aria-pressed': query.get('group') ? 'true' : 'false',
            onclick: () => toggle(grouped, 'group')
        },
          'Group by component');
    const canvas = h('canvas', {
        tabindex: 0,
        role: 'img',
        'aria-label':
            'Drawing of the netlist. Use the search to read a pin with its writer and readers. Arrow keys move, plus and minus zoom, 0 shows everything.'
    });
    const details =
              h('div', {class: 'floating', hidden: true, role: 'region', 'aria-label': 'Details'}),
          note = h('span', {class: 'dim'});
    main.append(
        h('div', {class: 'column'},
          h('div', {class: 'bar'}, search, names, depth, grouped,
            h('button', {onclick: () => fit()}, 'Show all'), note),
          h('div', {class: 'fill'}, canvas, details)));

    const drawing = surface(canvas, (context, width, height) => {
        if ((!view.fitted || (!view.moved && view.size !== `${width} ${height}`)) &&
            graph.boxes.length > 0)
            fit(width, height);
        context.translate(view.x, view.y);
        context.scale(view.scale, view.scale);
        draw(context, {
            left: -view.x / view.scale,
            top: -view.y / view.scale,
            right: (width - view.x) / view.scale,
            bottom: (height - view.y) / view.scale
        });
    });

    /// `back`: the path leaves to the right, turns and runs to the left.
    function curve(context, path, back) {
        context.moveTo(...path[0]);
        for (let i = 1; i < path.length; i++) {
            const [x0, y0] = path[i - 1], [x1, y1] = path[i],
                       bend = Math.max(Math.abs(x1 - x0) * .45, 14);
            const begin = back && i > 1 ? -bend : bend,
                  end = back && i < path.length - 1 ? -bend : bend;
            context.bezierCurveTo(x0 + begin, y0, x1 - end, y1, x1, y1);
        }
    }
    function draw(context, seen) {
        const signal = all.get(selected)?.kind === 'sig' ? selected : all.get(selected)?.signal;
        context.font = font;
        context.textBaseline = 'middle';
        for (const edge of graph.edges) {
            const marked = edge.signal.name === signal;
            context.strokeStyle = typeColour(edge.signal.type);
            context.lineWidth = marked ? 3 : 1.3;
            context.globalAlpha = signal && !marked ? .35 : 1;
            context.setLineDash(edge.back || edge.loop ? [5, 4] : []);
            context.beginPath();
            curve(context, edge.path, edge.back || edge.loop);
            context.stroke();
        }
        context.globalAlpha = 1;
        context.setLineDash([]);
        for (const box of graph.boxes) {
            if (box.x > seen.right || box.x + box.width < seen.left || box.y > seen.bottom ||
                box.y + box.height < seen.top)
                continue;
            context.fillStyle = colour('--card');
            context.strokeStyle = box.id === selected ? colour('--accent') : colour('--dim');
            context.lineWidth = box.id === selected ? 3 : 1;
            context.beginPath();
            context.roundRect(box.x, box.y, box.width, box.height, 5);
            context.fill();
            context.stroke();
            if (view.scale < .25) continue;
            context.fillStyle = colour('--text');
            context.font = 'bold ' + font;
            context.fillText(`${box.collapsed ? '▸' : '▾'} ${box.id}`, box.x + 6, box.y + head / 2);
            context.font = font;
            if (box.collapsed) continue;
            for (const port of box.ports.values()) {
                const y = box.y + port.y, x = port.input ? box.x : box.x + box.width;
                context.fillStyle = typeColour(port.pin.type);
                context.beginPath();
                context.arc(x, y, port.pin.name === selected ? 5 : 3, 0, 7);
                context.fill();
                context.fillStyle = colour('--text');
                context.textAlign = port.input ? 'left' : 'right';
                context.fillText(port.label, port.input ? x + 8 : x - 8, y);
                context.textAlign = 'left';
                const value = values.get(port.pin.signal);
                if (!port.input && value !== undefined && view.scale >= .45) {
                    context.fillStyle = colour('--dim');
                    context.fillText(
                        typeof value === 'number' ? number(Number(value.toPrecision(4))) :
                                                    number(value),
                        x + 6, y - 7);
                }
            }
        }
    }
    function fit(width = canvas.clientWidth, height = canvas.clientHeight) {
        view.scale = Math.min(1.2, (width - 40) / (size.width + 60), (height - 40) / size.height);
        view.x = (width - size.width * view.scale) / 2;
        view.y = (height - size.height * view.scale) / 2;
        Object.assign(view, {fitted: true, moved: false, size: `${width} ${height}`});
        drawing.request();
    }
    function zoom(factor, x, y) {
        const scale = Math.min(4, Math.max(.03, view.scale * factor));
        view.x = x - (x - view.x) * scale / view.scale;
        view.y = y - (y - view.y) * scale / view.scale;
        view.scale = scale;
        view.moved = true;
        drawing.request();
    }
    function toggle(button, key) {
        button.setAttribute('aria-pressed', button.getAttribute('aria-pressed') !== 'true');
        remember({[key]: button.getAttribute('aria-pressed') === 'true' ? '1' : ''});
        arrange();
    }
    function arrange() {
        graph = build(all, grouped.getAttribute('aria-pressed') === 'true', collapsed);
        const whole = graph.boxes.length;
        if (depth.value !== '' && search.value !== '')
            graph = neighbourhood(graph, search.value, Number(depth.value));
        if (graph.boxes.length > most)
            graph = {
                boxes: graph.boxes.slice(0, most),
                edges: graph.edges.filter(
                    edge => graph.boxes.findIndex(b => b.id === edge.from) < most &&
                        graph.boxes.findIndex(b => b.id === edge.to) < most)
            };
        size = layered(graph.boxes, graph.edges);
        view.fitted = false;
        text(note, `${graph.boxes.length} of ${whole} boxes, ${graph.edges.length} links`);
        canvas.dataset.boxes = graph.boxes.length;
        follow();
        drawing.request();
    }
    function follow() {
        if (end) end();
        const shown =
            [...new Set(graph.boxes.flatMap(box => box.outputs.map(pin => pin.signal)))].slice(
                0, 1000);
        end = shown.length === 0 ? null : subscribe(shown, 200, got => {
            shown.forEach((name, i) => values.set(name, got[i]));
            canvas.dataset.values = values.size;
            drawing.request();
            const live = details.querySelector('[data-live]');
            if (live) text(live, number(values.get(live.dataset.live)));
        }, true);
    }
    async function select(name, move) {
        selected = name;
        remember({pin: name});
        const object = all.get(name);
        drawing.request();
        details.hidden = name === '';
        if (name === '') return;
        if (move) centre(name);
        const signal = object?.kind === 'sig' ? object : all.get(object?.signal);
        const content = [
            h('button', {style: null, 'aria-label': 'close', onclick: () => select('')}, '×'),
            h('h2', {class: 'mono'}, name)
        ];
        if (object)
            content.push(
                h('p', {},
                  `${object.type} ${object.dir ?? 'signal'}${
                      object.unit ? `, ${object.unit}` : ''}`),
                object.doc ? h('p', {class: 'dim'}, object.doc) : '');
        if (signal) {
            content.push(
                h('p', {}, 'value ',
                  h('b', {class: 'mono', 'data-live': signal.name},
                    number(values.get(signal.name) ?? signal.value))),
                h('p', {}, `signal ${signal.name}`),
                h('p', {},
                  signal.writer ? `written by ${signal.writer}` : 'no writer: sets sets it'));
            const reply = await request({run: ['show', 'latency']});
            const lines = reply.ok ?
                reply.out.split('\n').filter(
                    l => signal.pins.some(pin => l.includes(` ${pin}`) || l.startsWith(pin)) &&
                        l.includes(signal.name)) :
                [];
            const readers = signal.pins.filter(pin => pin !== signal.writer);
            content.push(
                h('h2', {}, 'Readers'),
                h('ul', {class: 'plain'},
                  readers.length === 0 ? h('li', {class: 'dim'}, 'none') : readers.map(pin => {
                      const found = lines.find(l => l.includes(pin));
                      return h(
                          'li', {},
                          h('button', {class: 'mono', onclick: () => select(pin, true)}, pin),
                          h('div', {class: 'dim'}, latency(found, pin)));
                  })));
        } else if (object)
            content.push(h('p', {class: 'dim'}, 'not linked'));
        const box = graph.boxes.find(one => one.id === name);
        if (box)
            content.push(
                h('p', {class: 'dim'},
                  box.threads.size > 0 ? `runs in ${[...box.threads].join(', ')}` : ''),
                h('button', {onclick: () => fold(name)}, box.collapsed ? 'Expand' : 'Collapse'));
        details.replaceChildren(...content);
    }
    const latency = (found, pin) =>
        found ? found.slice(found.indexOf(pin) + pin.length).replace(/^[\s:,]+/, '') : '';
    function fold(name) {
        if (collapsed.has(name))
            collapsed.delete(name);
        else
            collapsed.add(name);
        remember({collapsed: [...collapsed].join(',')});
        const keep = {...view};
        arrange();
        Object.assign(view, keep);
        select(name);
    }
    function centre(name) {
        const box = graph.boxes.find(
            one => one.id === name || one.ports.has(name) ||
                [...one.ports.values()].some(port => port.pin.signal === name));
        if (!box) return;
        view.scale = Math.max(view.scale, .8);
        view.x = canvas.clientWidth / 2 - (box.x + box.width / 2) * view.scale;
        view.y = canvas.clientHeight / 2 - (box.y + box.height / 2) * view.scale;
        view.fitted = view.moved = true;
        drawing.request();
    }
    function hit(x, y) {
        const gx = (x - view.x) / view.scale, gy = (y - view.y) / view.scale;
        for (const box of graph.boxes) {
            if (gx < box.x - 8 || gx > box.x + box.width + 8 || gy < box.y ||
                gy > box.y + box.height)
                continue;
            if (!box.collapsed && gy > box.y + head)
                for (const port of box.ports.values())
                    if (Math.abs(gy - box.y - port.y) < line / 2 &&
                        port.input === gx < box.x + box.width / 2)
                        return {pin: port.pin.name};
            return {box: box.id, arrow: gx < box.x + 20};
        }
        return null;
    }

    const pointers = new Map();
    let moved = 0;
    canvas.addEventListener('pointerdown', event => {
        pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
        moved = 0;
        canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener('pointermove', event => {
        const before = pointers.get(event.pointerId);
        if (!before) return;
        const now = [event.offsetX, event.offsetY];
        moved += Math.abs(now[0] - before[0]) + Math.abs(now[1] - before[1]);
        if (pointers.size === 2) {
            const [other] =
                [...pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
            zoom(
                Math.hypot(now[0] - other[0], now[1] - other[1]) /
                    Math.max(Math.hypot(before[0] - other[0], before[1] - other[1]), 1),
                other[0], other[1]);
        } else {
            view.x += now[0] - before[0];
            view.y += now[1] - before[1];
            view.moved = true;
        }
        pointers.set(event.pointerId, now);
        drawing.request();
    });
    const release = event => {
        if (!pointers.delete(event.pointerId) || moved > 6 || event.type === 'pointercancel')
            return;
        const found = hit(event.offsetX, event.offsetY);
        if (found?.arrow)
            fold(found.box);
        else
            select(found?.pin ?? found?.box ?? '');
    };
    canvas.addEventListener('pointerup', release);
    canvas.addEventListener('pointercancel', release);
    canvas.addEventListener('wheel', event => {
        event.preventDefault();
        zoom(Math.exp(-event.deltaY / 400), event.offsetX, event.offsetY);
    }, {passive: false});
    canvas.addEventListener('keydown', event => {
        const step = {
            ArrowLeft: [60, 0],
            ArrowRight: [-60, 0],
            ArrowUp: [0, 60],
            ArrowDown: [0, -60]
        }[event.key];
        if (step) {
            view.x += step[0];
            view.y += step[1];
            view.moved = true;
            drawing.request();
        } else if (event.key === '+' || event.key === '-')
            zoom(event.key === '+' ? 1.25 : .8, canvas.clientWidth / 2, canvas.clientHeight / 2);
        else if (event.key === '0')
            fit();
        else if (event.key === 'Escape')
            select('');
        else
            return;
        event.preventDefault();
    });
    search.addEventListener('change', () => {
        remember({around: search.value});
        if (depth.value !== '') arrange();
        const name = search.value;
        if (all.has(name) || graph.boxes.some(one => one.id === name))
            select(name, true);
        else {
            const found = [...all.keys()].find(other => other.includes(name));
            if (found && name !== '') select(found, true);
        }
    });
    depth.addEventListener('change', () => {
        remember({depth: depth.value});
        arrange();
    });

    async function load() {
        all = await objects(true);
        if (!open) return;
        arrange();
        names.replaceChildren(
            ...[...new Set([
                ...graph.boxes.map(one => one.id),
                ...[...all.values()].filter(o => o.kind === 'sig' || o.signal).map(o => o.name)
            ])].slice(0, 2000)
                .map(value => h('option', {value})));
        if (selected !== '') select(selected, !view.fitted);
    }
    load();
    const ends = [on('machine', load)];
    return () => {
        open = false;
        ends.forEach(one => one());
        if (end) end();
        drawing.end();
    };
}
