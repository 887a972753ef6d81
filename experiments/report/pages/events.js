// The events of a run: a list, marks below the slider, and the way from one to the next.

class EventList {
  constructor(list, marks, events, time, goTo) {
    this.events = events;
    this.items = [...list.querySelectorAll("button")];
    this.list = list;
    this.current = -1;
    const end = Math.max(time[time.length - 1] - time[0], 1e-6);
    const share = (step) => (100 * (time[step] - time[0])) / end;
    this.items.forEach((item, number) => {
      item.addEventListener("click", () => goTo(events[number].step));
    });
    if (!marks) return;
    marks.replaceChildren(...events.map(({ step, until, gravity }) => {
      const mark = document.createElement("i");
      mark.className = gravity;
      mark.style.left = `${share(step)}%`;
      if (until !== null && until > step) mark.style.width = `${share(until) - share(step)}%`;
      return mark;
    }));
  }

  // The step of the first event after (1) or the last before (-1) a step; null at an end.
  from(step, way) {
    const steps = this.events.map((event) => event.step);
    const found = way > 0 ? steps.find((one) => one > step) : steps.findLast((one) => one < step);
    return found === undefined ? null : found;
  }

  // Mark the events that go on in a step, or else the last one before it.
  show(step) {
    const last = this.events.findLastIndex((event) => event.step <= step);
    if (last === this.current) return;
    if (this.current >= 0) this.items[this.current].removeAttribute("aria-current");
    this.current = last;
    if (last < 0) return;
    const item = this.items[last];
    item.setAttribute("aria-current", "true");
    const { list } = this;
    const top = item.offsetTop - list.offsetTop;
    if (top < list.scrollTop || top + item.offsetHeight > list.scrollTop + list.clientHeight) {
      list.scrollTop = top - list.clientHeight / 3;
    }
  }
}
