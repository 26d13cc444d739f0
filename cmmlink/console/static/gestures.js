// Mouse and keys of a drawing: zoom, pan, read-out. The same for both drawings, and everything the mouse does the keys do too.

const ZOOM = 1.25;
const STEP_PX = 4;

// onCursor(point or null): the point that both drawings read out.
export function listen(drawing, onCursor, worstPoint) {
  const { element } = drawing;
  let dragged = null, cursor = null;
  const placeOf = (event) => {
    const box = element.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const read = (point) => {
    cursor = point && { ...point, by: drawing.name };
    onCursor(cursor);
  };
  const middle = () => (cursor ? drawing.place(cursor) : [drawing.sheet.width / 2, drawing.sheet.height / 2]);

  element.addEventListener("wheel", (event) => {
    event.preventDefault();
    if (drawing.nominal) drawing.zoom(event.deltaY > 0 ? ZOOM : 1 / ZOOM, ...placeOf(event));
  }, { passive: false });
  element.addEventListener("pointerdown", (event) => {
    dragged = placeOf(event);
    element.setPointerCapture(event.pointerId);
  });
  element.addEventListener("pointerup", () => (dragged = null));
  element.addEventListener("pointermove", (event) => {
    const place = placeOf(event);
    if (!drawing.nominal) return;
    if (dragged && event.buttons) {
      drawing.pan(dragged[0] - place[0], dragged[1] - place[1]);
      dragged = place;
    } else read(drawing.nearest(...place));
  });
  element.addEventListener("pointerleave", () => read(null));
  element.addEventListener("dblclick", () => drawing.fit());
  element.addEventListener("blur", () => read(null));

  const step = (event, dx, dy) => {
    const far = 60;
    if (event.shiftKey) return drawing.pan(dx * far, dy * far);
    const [x, y] = middle();
    let next = null;
    for (let reach = STEP_PX; reach < 600 && !moved(next, cursor); reach *= 2) next = drawing.nearest(x + dx * reach, y + dy * reach);
    if (next) {
      read(next);
      drawing.reveal(next);
    }
  };
  const keys = {
    "+": () => drawing.zoom(1 / ZOOM, ...middle()),
    "=": () => drawing.zoom(1 / ZOOM, ...middle()),
    "-": () => drawing.zoom(ZOOM, ...middle()),
    "0": () => drawing.fit(),
    ArrowLeft: (event) => step(event, -1, 0),
    ArrowRight: (event) => step(event, 1, 0),
    ArrowUp: (event) => step(event, 0, -1),
    ArrowDown: (event) => step(event, 0, 1),
    w: () => {
      const worst = worstPoint();
      if (worst) {
        read(worst);
        drawing.reveal(worst);
      }
    },
  };
  element.addEventListener("keydown", (event) => {
    const act = keys[event.key] ?? keys[event.key.toLowerCase()];
    if (!act || !drawing.nominal || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    act(event);
  });
}

const moved = (next, cursor) => next && (!cursor || next.bin !== cursor.bin || next.side !== cursor.side);
