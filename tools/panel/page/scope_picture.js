// SPDX-License-Identifier: MIT
// The picture of the scope, pixel by pixel: all its lines are horizontal or vertical, and without a
// GPU this takes a tenth of the time of strokes.

/// A colour of CSS as a pixel.
let mixer = null;  // a canvas of one pixel
function pixel(name) {
    mixer ??= document.createElement('canvas');
    const context = mixer.getContext('2d', {willReadFrequently: true});
    context.fillStyle = name;
    context.fillRect(0, 0, 1, 1);
    return new Uint32Array(context.getImageData(0, 0, 1, 1).data.buffer)[0];
}

export class Picture {
    constructor() {
        this.colours = new Map();
        this.width = this.height = this.thick = 0;
    }
    /// Begins a picture of that many pixels. `thick`: pixels of a line. `key`: what drawGround()
    /// depends on besides, which draws what is behind the traces and is the same in most pictures.
    begin(width, height, thick, back, key, drawGround) {
        if (!this.image || this.image.width !== width || this.image.height !== height) {
            this.image = new ImageData(width, height);
            this.pixels = new Uint32Array(this.image.data.buffer);
            this.ground = new Uint32Array(width * height);
            this.groundKey = '';
        }
        this.width = width;
        this.height = height;
        this.thick = thick;
        const wholeKey = `${thick} ${back} ${key}`;
        if (this.groundKey === wholeKey) {
            this.pixels.set(this.ground);
            return;
        }
        this.pixels.fill(this.colour(back));
        drawGround();
        this.ground.set(this.pixels);
        this.groundKey = wholeKey;
    }
    colour(name) {
        if (!this.colours.has(name)) this.colours.set(name, pixel(name));
        return this.colours.get(name);
    }
    /// Pixels [x, x + wide) of the rows [y0, y1].
    fill(x, wide, y0, y1, paint) {
        const {width, pixels} = this, begin = Math.max(0, x), end = Math.min(width, x + wide),
                      top = Math.max(0, y0), bottom = Math.min(this.height - 1, y1);
        for (let y = top; y <= bottom; y++)
            for (let at = y * width + begin, stop = y * width + end; at < stop; at++)
                pixels[at] = paint;
    }
    vertical(x, name, dotted = false) {
        const paint = this.colour(name);
        for (let y = 0; y < this.height; y += dotted ? 6 : this.height)
            this.fill(Math.round(x), this.thick, y, dotted ? y + 1 : this.height, paint);
    }
    /// The first row of a horizontal line, and the first one below it, within the picture.
    rowsOf(y) {
        const row = Math.round(y), limit = at => Math.max(0, Math.min(this.height, at));
        return [limit(row), limit(row + this.thick)];
    }
    horizontal(y, name, dotted = false) {
        const paint = this.colour(name), row = Math.round(y);
        for (let x = 0; x < this.width; x += dotted ? 6 : this.width)
            this.fill(x, dotted ? 2 : this.width, row, row + this.thick - 1, paint);
    }

    /// Until when the value of a row is shown.
    until(group, row, to) {
        if (row + 1 < group.count) return group.time(row + 1);
        return Math.min(to, group.time(row) + group.hold);
    }

    /// Whether a channel has so many samples that each column of pixels is a line from their
    /// minimum to their maximum.
    isDense(store, channel, from, to) {
        const place = store.place.get(channel);
        if (!place || store.isCoarse(channel, from)) return false;
        const [group] = place, begin = Math.max(group.row(from) - 1, group.first);
        return Math.min(group.row(to) + 1, group.count) - begin >= 2 * this.width;
    }

    /// A channel. With many samples per column of pixels, a column is a line from their minimum to
    /// their maximum; with few, the trace is stairs. `line`: {name, thick, dashed}. A value is at
    /// the row zero - value * perUnit. `each`: seconds of a column, which has to be the same number
    /// in all pictures of a time base.
    trace(store, channel, from, to, zero, perUnit, line, each = (to - from) / this.width) {
        const place = store.place.get(channel);
        if (!place) return;
        const [group, column] = place, begin = Math.max(group.row(from) - 1, group.first),
                      end = Math.min(group.row(to) + 1, group.count),
                      paint = this.colour(line.name);
        if (store.isCoarse(channel, from))
            return this.traceCoarse(store.history(channel), from, each, zero, perUnit, line);
        const pixelRow = row => Math.max(
            -9, Math.min(this.height + 9, Math.round(zero - group.value(column, row) * perUnit)));
        if (end - begin < 2 * this.width) {
            for (let row = begin; row < end; row++) {
                const at = Math.floor((group.time(row) - from) / each),
                      next = Math.floor((this.until(group, row, to) - from) / each);
                const here = pixelRow(row), before = row > begin ? pixelRow(row - 1) : here;
                if (line.dashed) {
                    for (let x = Math.max(at, 0); x < Math.min(next, this.width); x++)
                        if (x % 12 < 8) this.fill(x, 1, here, here + line.thick - 1, paint);
                } else
                    this.fill(at, next - at, here, here + line.thick - 1, paint);
                if (here !== before && !(line.dashed && at % 12 >= 8))
                    this.fill(
                        at, line.thick, Math.min(here, before),
                        Math.max(here, before) + line.thick - 1, paint);
            }
            return;
        }
        const columns = store.columns(channel, each), first = Math.floor(from / each);
        this.columnsInto(this.pixels, columns, first, 0, zero, perUnit, line);
    }

    /// Draws the columns of a channel from the column `begin` on. `first`: the interval of the
    /// column 0.
    columnsInto(pixels, columns, first, begin, zero, perUnit, line) {
        const {width, height} = this, {dashed, thick} = line, paint = this.colour(line.name),
              {index, low, high, mask, newest} = columns;
        let top = NaN, bottom = NaN;
        // what holds at the begin
        for (let x = begin - 1; x > -width && top !== top; x--) {
            const at = (first + x) & mask;
            if (index[at] === first + x) top = bottom = Math.round(zero - low[at] * perUnit);
        }
        for (let x = begin; x < width; x++) {  // the hot loop: no calls
            const interval = first + x, at = interval & mask;
            if (index[at] === interval) {
                top = Math.round(zero - high[at] * perUnit);
                bottom = Math.round(zero - low[at] * perUnit);
            } else if (interval > newest || top !== top)
                continue;
            else
                top = bottom;  // no sample in this column: the last value holds
            if (dashed && interval % 12 >= 8) continue;
            const end = (bottom + thick < height ? bottom + thick : height) * width;
            for (let cell = (top > 0 ? top : 0) * width + x; cell < end; cell += width)
                pixels[cell] = paint;
        }
    }

    /// A channel whose rows are overwritten: a column is a line from its minimum to its maximum.
    traceCoarse(columns, from, each, zero, perUnit, line) {
        const paint = this.colour(line.name), {dashed, thick} = line;
        let last = NaN;
        for (let x = 0; x < this.width; x++) {
            const found = columns.extremes(from + x * each, from + (x + 1) * each);
            if (!found && from + x * each > (columns.newest + 1) * columns.width) return;
            const [low, high] = found ?? [last, last];
            last = high;
            if (Number.isNaN(low) || (dashed && x % 12 >= 8)) continue;
            const top = Math.round(zero - high * perUnit),
                  bottom = Math.round(zero - low * perUnit);
            this.fill(x, 1, top, bottom + thick - 1, paint);
        }
    }
}
