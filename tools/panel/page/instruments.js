// SPDX-License-Identifier: MIT
// Widgets that are drawn: bar, meter, chart, dial and jog wheel.
import {colour, h, number, surface} from './dom.js';
import {isLive} from './link.js';
import {follow, formatted, nice} from './widget_values.js';

/// The ranges of a bar or meter as [low, high, colour]: PyVCP's, or from `warn` and `alarm` of a
/// .panel file.
function ranges(options, low, high, name) {
    const given = [1, 2, 3]
                      .map(i => options[name + i])
                      .filter(range => Array.isArray(range) && range.length === 3);
    if (given.length > 0) return name === 'range' && given.length < 3 ? [] : given;
    const all = [];
    if (options.warn !== undefined) all.push([options.warn, options.alarm ?? high, '#d99a00']);
    if (options.alarm !== undefined) all.push([options.alarm, high, '#d02020']);
    return all;
}

function drawn(node, pins, width, height, draw) {
    const canvas = h('canvas', {role: 'img'});
    canvas.style.width = typeof width === 'number' ? `${width}px` : width;
    canvas.style.maxWidth = '100%';
    canvas.style.height = `${height}px`;
    const picture = surface(canvas, draw);
    pins.ends.push(picture.end);
    return {canvas, picture};
}

export function makeBar(node, pins) {
    const options = node.options ?? {}, low = options.min_ ?? options.min ?? 0,
          high = options.max_ ?? options.max ?? 100,
          unit = options.unit ?? pins.unit(node.pin);
    let now = 0;
    const words = value => options.format || !node.kind ?
        formatted(value, options.format ?? '3.1f') :
        number(Number(Number(value).toPrecision(5)));
    const {canvas, picture} = drawn(
        node, pins, node.kind ? '100%' : options.canvas_width ?? 200, options.canvas_height ?? 50,
        (context, width, height) => {
            const bar = node.kind ? width - 2 : Math.min(options.bar_width ?? 150, width - 2),
                  tall = Math.min(options.bar_height ?? 30, height - 16), left = (width - bar) / 2;
            const share = Math.min(1, Math.max(0, (now - low) / (high - low))),
                  all = ranges(options, low, high, 'range'),
                  hit = all.filter(range => now >= range[0] && now <= range[1]).pop();
            context.fillStyle = options.bgcolor || colour('--grid');
            context.fillRect(left, 1, bar, tall);
            context.fillStyle = hit ? hit[2] : options.fillcolor || '#18a030';
            const zero = Math.min(1, Math.max(0, (0 - low) / (high - low)));
            context.fillRect(
                left + bar * Math.min(zero, share), 1, bar * Math.abs(share - zero), tall);
            context.strokeStyle = colour('--dim');
            context.strokeRect(left + .5, 1.5, bar - 1, tall - 1);
            context.font = '12px system-ui, sans-serif';
            context.fillStyle = colour('--text');
            context.textAlign = 'center';
            context.fillText(`${words(now)}${unit ? ` ${unit}` : ''}`, width / 2, tall / 2 + 5);
            context.fillStyle = colour('--dim');
            context.textAlign = 'left';
            context.fillText(number(low), left, tall + 13);
            context.textAlign = 'right';
            context.fillText(number(high), left + bar, tall + 13);
        });
    follow(node, pins, value => {
        now = Number(value);
        canvas.setAttribute('aria-label', `${options.text ?? node.pin}: ${words(now)} ${unit}`);
        canvas.dataset.value = now;
        picture.request();
    });
    return node.kind ? h('div', {class: 'w-gauge'}, h('div', {}, options.text), canvas) : canvas;
}

export function makeMeter(node, pins) {
    const options = node.options ?? {}, low = options.min_ ?? options.min ?? 0,
          high = options.max_ ?? options.max ?? 100, size = options.size ?? (node.kind ? 170 : 200);
    const unit = options.unit ?? pins.unit(node.pin),
          major = options.majorscale ?? (node.kind ? nice((high - low) / 8) : (high - low) / 10),
          minor = options.minorscale ?? 0;
    let now = 0;
    const from = Math.PI * (.5 + 37 / 180), span = Math.PI * 286 / 180,
          angle = value => from + span * (value - low) / (high - low);
    const {canvas, picture} = drawn(node, pins, size, size, (context, width, height) => {
        const radius = Math.min(width, height) / 2 - 4, x = width / 2, y = height / 2,
              ray = (value, a, b, wide) => {
                  const t = angle(value);
                  context.lineWidth = wide;
                  context.beginPath();
                  context.moveTo(x + a * Math.cos(t), y + a * Math.sin(t));
                  context.lineTo(x + b * Math.cos(t), y + b * Math.sin(t));
                  context.stroke();
              };
        context.lineWidth = radius * .09;
        for (const [begin, end, paint] of [
                 [low, high, colour('--grid')], ...ranges(options, low, high, 'region')]) {
            context.strokeStyle = paint;
            context.beginPath();
            context.arc(
                x, y, radius * .92, angle(Math.max(low, begin)), angle(Math.min(high, end)));
            context.stroke();
        }
        context.strokeStyle = context.fillStyle = colour('--text');
        context.font = `${Math.max(9, radius * .13)}px system-ui, sans-serif`;
        context.textAlign = 'center';
        context.textBaseline = 'middle';
        if (minor > 0 && (high - low) / minor < 200)
            for (let v = low; v <= high + minor / 1e6; v += minor)
                ray(v, radius * .87, radius * .95, 1);
        if (major > 0 && (high - low) / major < 50)
            for (let i = node.kind ? Math.ceil(low / major - 1e-9) : 0;; i++) {
                const v = (node.kind ? 0 : low) + i * major;
                if (v > high + major / 1e6) break;
                ray(v, radius * .84, radius * .97, 1.5);
                context.fillText(
                    number(Number(v.toPrecision(4))), x + radius * .68 * Math.cos(angle(v)),
                    y + radius * .68 * Math.sin(angle(v)));
            }
        // below the middle, where no value is, the needle never covers them
        context.fillText(options.text ?? '', x, y + radius * .3);
        context.fillText(options.subtext ?? unit, x, y + radius * .5);
        if (node.kind) {
            context.font = `bold ${radius * .17}px system-ui, sans-serif`;
            context.fillText(number(Number(Number(now).toPrecision(4))), x, y + radius * .78);
        }
        context.strokeStyle = '#d02020';
        ray(Math.min(high, Math.max(low, now)), -radius * .12, radius * .8, 3);
        context.beginPath();
        context.arc(x, y, radius * .06, 0, 7);
        context.fill();
    });
    follow(node, pins, value => {
        now = Number(value);
        canvas.setAttribute('aria-label', `${options.text ?? node.pin}: ${number(now)} ${unit}`);
        canvas.dataset.value = now;
        picture.request();
    });
    return canvas;
}

export function makeChart(node, pins) {
    const options = node.options ?? {}, keep = (options.seconds ?? 30) * 1000,
          unit = options.unit ?? pins.unit(node.pin), points = [];
    const {canvas, picture} = drawn(node, pins, '100%', 120, (context, width, height) => {
        const now = performance.now();
        while (points.length > 2 && points[1][0] < now - keep)
            points.shift();
        const values = points.map(point => point[1]).filter(value => value !== null);
        let low = options.min ?? Math.min(...values), high = options.max ?? Math.max(...values);
        if (!(high > low)) {
            low -= 1;
            high += 1;
        }
        const y = value => height - 4 - (height - 8) * (value - low) / (high - low);
        const across = time => width * (1 - (now - time) / keep);
        context.strokeStyle = colour('--accent');
        context.fillStyle = colour('--line');
        context.lineWidth = 1.5;
        context.beginPath();
        points.forEach(([time, value], i) => {
            const x = across(time), end = across(points[i + 1]?.[0] ?? now);
            if (value === null) return context.fillRect(x, 0, end - x, height);
            const before = points[i - 1]?.[1] ?? null;
            if (before === null)
                context.moveTo(x, y(value));
            else
                context.lineTo(x, y(value));
            context.lineTo(end, y(value));
        });
        context.stroke();
        if (values.length === 0) return;
        context.font = '11px system-ui, sans-serif';
        context.fillStyle = colour('--dim');
        context.fillText(number(Number(high.toPrecision(4))), 2, 12);
        context.fillText(number(Number(low.toPrecision(4))), 2, height - 4);
    });
    let last = null;
    /// Adds a value; null: the machine does not run from now on.
    const add = value => {
        points.push([performance.now(), value]);
        if (points.length > 4000) points.shift();
    };
    const look = () => {
        const isPaused = (points[points.length - 1]?.[1] ?? null) === null;
        if (last !== null && isLive() === isPaused) add(isPaused ? last : null);
        picture.request();
    };
    follow(node, pins, value => {
        last = Number(value);
        if (isLive()) add(last);
        canvas.setAttribute(
            'aria-label', `${options.text ?? node.pin}: ${number(Number(value))} ${unit}`);
    });
    const clock = setInterval(look, 100);
    pins.ends.push(() => clearInterval(clock));
    return h(
        'div', {class: 'w-gauge'},
        h('div', {}, `${options.text ?? node.pin}${unit ? ` (${unit})` : ''}`), canvas);
}

/// A wheel to turn by mouse, finger, wheel or keys: dial and jog wheel.
export function knob(node, pins, {step, turn, reset = undefined, low, high}) {
    const options = node.options ?? {}, size = options.size ?? (node.kind ? 130 : 200),
          perTurn = options.cpr ?? 40;
    let by = step, grip = null;
    const {canvas, picture} = drawn(node, pins, size, size, (context, width, height) => {
        const radius = Math.min(width, height) / 2 - 3, x = width / 2, y = height / 2,
              value = pins.value(node.pin) ?? 0;
        context.fillStyle = options.dialcolor || options.fillcolor || colour('--grid');
        context.strokeStyle = options.edgecolor || colour('--dim');
        context.lineWidth = 2;
        context.beginPath();
        context.arc(x, y, radius, 0, 7);
        context.fill();
        context.stroke();
        const t = 2 * Math.PI * (value / by % perTurn) / perTurn - Math.PI / 2;
        context.fillStyle = options.dotcolor || colour('--accent');
        context.beginPath();
        context.arc(
            x + radius * .72 * Math.cos(t), y + radius * .72 * Math.sin(t), radius * .13, 0, 7);
        context.fill();
        context.fillStyle = options.dialcolor || options.fillcolor ? '#000' : colour('--text');
        context.font = `${Math.max(11, radius * .17)}px system-ui, sans-serif`;
        context.textAlign = 'center';
        context.fillText(String(options.text ?? ''), x, y - radius * .1);
        context.fillText(number(value), x, y + radius * .2);
        if (by !== step) context.fillText(`step ${number(by)}`, x, y + radius * .45);
    });
    Object.assign(canvas, {tabIndex: 0});
    canvas.setAttribute('role', 'slider');
    canvas.dataset.output = '';
    canvas.style.touchAction = 'none';
    if (Number.isFinite(low)) canvas.setAttribute('aria-valuemin', low);
    if (Number.isFinite(high)) canvas.setAttribute('aria-valuemax', high);
    canvas.setAttribute('aria-label', String(options.text ?? node.pin));
    pins.bind(node.pin, value => {
        canvas.setAttribute('aria-valuenow', value ?? 0);
        picture.request();
    });
    const at = event =>
        Math.atan2(
            event.offsetY - canvas.clientHeight / 2, event.offsetX - canvas.clientWidth / 2) /
        (2 * Math.PI) * perTurn;
    canvas.addEventListener('pointerdown', event => {
        if (event.shiftKey && reset) return reset();
        grip = at(event);
        canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener('pointermove', event => {
        if (grip === null) return;
        let steps = at(event) - grip;
        if (steps > perTurn / 2) steps -= perTurn;
        if (steps < -perTurn / 2) steps += perTurn;
        const whole = Math.trunc(steps);
        if (whole === 0) return;
        turn(whole, by);
        grip += whole;
    });
    for (const end of ['pointerup', 'pointercancel'])
        canvas.addEventListener(end, () => {
            grip = null;
        });
    canvas.addEventListener('wheel', event => {
        event.preventDefault();
        turn(-Math.sign(event.deltaY), by);
    }, {passive: false});
    canvas.addEventListener('dblclick', () => {
        by = step === 1 ? by : by / 10;
        picture.request();
    });
    canvas.addEventListener('contextmenu', event => {
        event.preventDefault();
        if (event.detail > 1 && step !== 1) {
            by *= 10;
            picture.request();
        }
    });
    canvas.addEventListener('keydown', event => {
        const steps = {
            ArrowUp: 1,
            ArrowRight: 1,
            ArrowDown: -1,
            ArrowLeft: -1,
            PageUp: 10,
            PageDown: -10
        }[event.key];
        if (steps)
            turn(steps, by);
        else if (event.key === 'Home' && reset)
            reset();
        else
            return;
        event.preventDefault();
    });
    return canvas;
}
