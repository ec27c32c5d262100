// Controls beside the picture, and the keyboard.
import * as THREE from 'three';

const names = { outer: 'Outer surface', mesh: 'Mesh', inner: 'Inner surface' };
const initialOpacity = { outer: 0.3, mesh: 1, inner: 1 };
const element = (id) => document.getElementById(id);

function make(tag, properties = {}, ...children) {
  const node = Object.assign(document.createElement(tag), properties);
  node.append(...children);
  return node;
}

/// Marks the chosen one of a group of buttons.
function choose(group, attribute, value) {
  for (const button of group.querySelectorAll('button'))
    button.setAttribute('aria-pressed', String(button.dataset[attribute] === value));
}

export class Panel {
  constructor(scene, data) {
    this.scene = scene;
    this.data = data;
    this.axis = 'x';
    this.flipped = false;
    this.field = 'inside';
    element('title').textContent = data.title;
    document.title = `${data.title} – implicit thin shell`;
    this.addBodies();
    this.addCut();
    this.addViews();
    this.addFacts();
    this.addLegend();
    this.addTheme();
    element('edges').addEventListener('change', (e) => scene.showEdges(e.target.checked));
    addEventListener('keydown', (event) => this.key(event));
    this.setAxis(data.up === 1 ? 'z' : 'y');
    this.updateCut();
  }

  addBodies() {
    let number = 0;
    for (const name of Object.keys(names)) {
      ++number;
      const present = name in this.scene.bodies;
      const shown = make('input', { type: 'checkbox', className: 'switch', id: `show-${name}`, checked: present, disabled: !present });
      const opacity = make('input', {
        type: 'range', id: `opacity-${name}`, min: 0.05, max: 1, step: 0.05, value: initialOpacity[name], disabled: !present,
        ariaLabel: `Opacity of the ${names[name].toLowerCase()}`,
      });
      shown.addEventListener('change', () => this.scene.show(name, shown.checked));
      opacity.addEventListener('input', () => this.scene.setOpacity(name, Number(opacity.value)));
      if (present) this.scene.setOpacity(name, initialOpacity[name]);
      const text = present ? this.data[name].text : this.data.has_inside ? 'none at this depth' : 'none: the mesh has no inside';
      element('bodies').append(make('div', { className: 'body' },
        make('label', { className: 'line' }, shown, make('i', { className: `chip ${name}` }), make('span', {}, names[name]),
             make('kbd', {}, String(number))),
        make('div', { className: 'detail' }, make('small', {}, text), opacity)));
    }
  }

  addCut() {
    element('cut').addEventListener('change', () => this.updateCut());
    element('at').addEventListener('input', () => this.updateCut());
    element('flip').addEventListener('click', () => this.flip());
    element('axis').addEventListener('click', (e) => e.target.dataset.axis && this.setAxis(e.target.dataset.axis));
    element('field').addEventListener('click', (e) => e.target.dataset.field && this.setField(e.target.dataset.field));
    choose(element('field'), 'field', this.field);
  }

  setAxis(axis) {
    this.axis = axis;
    this.flipped = false;
    const towards = this.scene.viewDirection();
    this.normal = axis === 'view' ? towards : new THREE.Vector3().setComponent('xyz'.indexOf(axis), 1);
    if (this.normal.dot(towards) < 0) this.normal.negate();  // the near part is taken away
    choose(element('axis'), 'axis', axis);
    this.updateCut();
  }

  setField(field) {
    this.field = field;
    choose(element('field'), 'field', field);
    this.updateCut();
  }

  flip() {
    this.normal.negate();
    element('at').value = 1 - element('at').value;
    this.updateCut();
  }

  updateCut() {
    const offset = this.scene.placeCut(this.normal, Number(element('at').value));
    this.scene.setCut(element('cut').checked, this.field);
    const { centre, scale } = this.data;
    const along = this.normal.dot(new THREE.Vector3(...centre));
    const sign = this.axis !== 'view' && Math.min(this.normal.x, this.normal.y, this.normal.z) < 0 ? -1 : 1;
    const name = this.axis === 'view' ? 'n·x' : this.axis;
    element('at-text').textContent = `${name} = ${(sign * (along + offset * scale)).toPrecision(4).replace('-', '−')}`;
  }

  addViews() {
    element('views').addEventListener('click', (e) => e.target.dataset.view && this.scene.view(e.target.dataset.view));
  }

  addFacts() {
    for (const [label, value] of this.data.facts)
      element('facts').append(make('tr', {}, make('th', { scope: 'row' }, label), make('td', {}, value)));
    for (const note of this.data.notes) element('notes').append(make('li', {}, note));
  }

  addLegend() {
    const { palette, has_inside: hasInside } = this.data;
    const context = element('bar').getContext('2d'), image = context.createImageData(257, 1);
    const first = hasInside ? -1 : 0;
    for (let i = 0; i < 257; ++i) {
      const t = first + ((1 - first) * i) / 256, entry = Math.round(128 * t + 128);
      image.data.set([...palette.subarray(3 * entry, 3 * entry + 3), 255], 4 * i);
    }
    context.putImageData(image, 0, 0);
    for (const value of [-0.5, -0.2, -0.05, 0, 0.05, 0.2, 0.5]) {
      if (value < first * 0.5) continue;
      const t = Math.sign(value) * Math.sqrt(Math.abs(value) / 0.5);
      const tick = make('span', {}, String(value).replace('-', '−'));
      tick.style.left = `${(100 * (t - first)) / (1 - first)}%`;
      element('ticks').append(tick);
    }
    const entries = [['shell', 'shell'], ...(hasInside ? [['inner', 'ε₁'], ['zero', 'f = 0']] : []), ['outer', 'ε₂']];
    for (const [kind, text] of entries) element('key').append(make('i', { className: `stroke ${kind}` }), `${text} `);
    element('key').append(make('small', {}, 'f ÷ longest side'));
  }

  addTheme() {
    const dark = matchMedia('(prefers-color-scheme: dark)');
    element('theme').addEventListener('click', () => {
      const now = document.documentElement.dataset.theme ?? (dark.matches ? 'dark' : 'light');
      document.documentElement.dataset.theme = now === 'dark' ? 'light' : 'dark';
    });
  }

  toggle(id) {
    const box = element(id);
    if (!box.disabled) box.click();
  }

  nudge(step) {
    const at = element('at');
    at.value = Number(at.value) + step;
    this.updateCut();
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.type === 'range') return;
    const turn = Math.PI / 24;
    const actions = {
      1: () => this.toggle('show-outer'), 2: () => this.toggle('show-mesh'), 3: () => this.toggle('show-inner'),
      c: () => this.toggle('cut'), e: () => this.toggle('edges'), f: () => this.flip(),
      x: () => this.setAxis('x'), y: () => this.setAxis('y'), z: () => this.setAxis('z'), v: () => this.setAxis('view'),
      '[': () => this.nudge(-0.02), ']': () => this.nudge(0.02), r: () => this.scene.view('reset'),
      '+': () => this.scene.zoom(1 / 1.15), '=': () => this.scene.zoom(1 / 1.15), '-': () => this.scene.zoom(1.15),
      ArrowLeft: () => this.scene.turn(-turn, 0), ArrowRight: () => this.scene.turn(turn, 0),
      ArrowUp: () => this.scene.turn(0, -turn), ArrowDown: () => this.scene.turn(0, turn),
    };
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }
}
