// SPDX-License-Identifier: MIT
// Small helpers. Names from the machine reach the page as text nodes only.

/// Makes an element: h('p', {class: 'x', onclick: f}, 'text', child).
export function h(name, options = {}, ...children) {
    const element = document.createElement(name);
    for (const [key, value] of Object.entries(options)) {
        if (value === undefined || value === null || value === false) continue;
        if (key.startsWith('on'))
            element.addEventListener(key.slice(2), value);
        else if (key in element && typeof value !== 'string')
            element[key] = value;
        else
            element.setAttribute(key, value);
    }
    element.append(...children.flat(9).filter(
        child => child !== null && child !== undefined && child !== false));
    return element;
}

/// Sets a text only when it differs: the browser then has nothing to lay out.
export function text(element, value) {
    if (element.textContent !== value) element.textContent = value;
}

export function number(value) {
    if (value === null || value === undefined) return '–';
    if (typeof value === 'boolean') return value ? 'TRUE' : 'FALSE';
    if (typeof value === 'string') return value;
    if (Number.isInteger(value)) return String(value);
    const size = Math.abs(value);
    return size !== 0 && (size < 1e-4 || size >= 1e7) ? value.toExponential(4) :
                                                        String(Number(value.toPrecision(7)));
}

const durations = [
    {limit: 1e3, factor: 1, unit: 'ns'},
    {limit: 1e6, factor: 1e3, unit: 'µs'},
    {limit: 1e9, factor: 1e6, unit: 'ms'},
    {limit: Infinity, factor: 1e9, unit: 's'},
];
/// A duration in ns with a unit.
export function duration(ns) {
    if (!(ns > 0)) return '0';
    const {factor, unit} = durations.find(({limit}) => ns < limit);
    return `${Number((ns / factor).toPrecision(3))} ${unit}`;
}

export const colour = name =>
    getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const typeColours = {
    bit: '--t-bit',
    float: '--t-float',
    port: '--t-port'
};
/// The colour of a type of pins.
export const typeColour = type => colour(typeColours[type] ?? '--t-int');

export const dark = matchMedia('(prefers-color-scheme: dark)');
dark.addEventListener('change', () => {
    for (const canvas of document.querySelectorAll('canvas'))
        canvas.dispatchEvent(new Event('redraw'));
});

/// From one picture of values that change by themselves to the next, in ms. Each picture costs the
/// browser as much as its canvas is large, and the browser may run on the computer of the machine.
export const pictureInterval = 50;
const frame = 17;  // ms at most from requestAnimationFrame() to the frame
const tolerance = 5;  // ms by which samples may come earlier: they are drawn when they come

/// Prepares a canvas for drawing in CSS pixels at the screen's resolution; draw() is called in the
/// next frame after request(), and after follow() when the last picture is old enough: request() is
/// for what the user does, follow() for what the machine does. Redraws at a change of size.
/// `opaque`: draw() paints every pixel. The canvas is then sent to the screen by itself, without
/// the other stages of a page's frame, which cost more than the canvas: what the machine does is
/// drawn at once, not in the next frame.
export function surface(canvas, draw, opaque = false) {
    let asked = false, timer = 0, painted = -Infinity;
    let width = 0, height = 0;  // CSS pixels
    const context = canvas.getContext('2d', {alpha: !opaque, desynchronized: opaque});
    // The size of an element makes the browser lay out the page: it is not read in every picture.
    const measure = () => {
        width = canvas.clientWidth;
        height = canvas.clientHeight;
    };
    const paint = () => {
        asked = false;
        clearTimeout(timer);
        timer = 0;
        painted = performance.now();
        if (!canvas.isConnected) return;
        if (width === 0 || height === 0) measure();
        if (width === 0 || height === 0) return;
        const ratio = devicePixelRatio || 1;
        if (canvas.width !== Math.round(width * ratio) ||
            canvas.height !== Math.round(height * ratio)) {
            canvas.width = Math.round(width * ratio);
            canvas.height = Math.round(height * ratio);
        }
        context.setTransform(ratio, 0, 0, ratio, 0, 0);
        if (!opaque) context.clearRect(0, 0, width, height);
        draw(context, width, height, ratio);
    };
    const request = () => {
        if (!asked) requestAnimationFrame(paint);
        asked = true;
    };
    const next = opaque ? () => (document.hidden ? request() : paint()) : request;
    const early = opaque ? tolerance : frame;
    const follow = () => {
        if (asked || timer !== 0) return;
        const wait = painted + pictureInterval - early - performance.now();
        if (wait <= 0) return next();
        timer = setTimeout(() => {
            timer = 0;
            next();
        }, wait);
    };
    const end = () => {
        clearTimeout(timer);
        watch.disconnect();
    };
    const watch = new ResizeObserver(() => {
        measure();
        request();
    });
    watch.observe(canvas);
    canvas.addEventListener('redraw', request);
    request();
    return {request, follow, end};
}

export function announce(message) { document.getElementById('announce').textContent = message; }
