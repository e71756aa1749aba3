// What happened, newest last: a line for each kind of event of each body, with how often and the last of them. Bounded.
const MOST = 100;  // lines; the oldest go first

export class EventList {
  // list: an <ol>; total: an element for the number of events.
  constructor(list, total) {
    Object.assign(this, { list, total, lines: new Map() });
    this.clear();
  }

  clear() {
    this.lines.clear();
    this.list.replaceChildren();
    this.count = 0;
    this.total.textContent = '0';
  }

  // event: {kind, body, step, message}
  add(event) {
    const key = `${event.kind} ${event.body}`;
    const line = this.lines.get(key) ?? this.open(event.kind);
    this.lines.delete(key);
    this.lines.set(key, line);  // a Map keeps the order in which keys came: this one is the newest again
    line.times += 1;
    const often = line.times > 1 ? `, ${line.times} times` : '';
    line.text.textContent = ` ${event.message} (step ${event.step ?? '?'}${often})`;
    const follows = this.list.scrollTop + this.list.clientHeight > this.list.scrollHeight - 8;
    this.list.append(line.item);
    for (const [oldest, { item }] of this.lines) {
      if (this.lines.size <= MOST) break;
      item.remove();
      this.lines.delete(oldest);
    }
    if (follows) this.list.scrollTop = this.list.scrollHeight;
    this.count += 1;
    this.total.textContent = String(this.count);
  }

  open(kind) {
    const item = document.createElement('li'), name = document.createElement('b'), text = document.createElement('span');
    item.dataset.kind = kind;
    name.textContent = kind;
    item.append(name, text);
    return { item, text, times: 0 };
  }
}
