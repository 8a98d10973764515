// Shows the arrays of a run through K3DInstance. It runs where K3D's page leaves room for a script.
const at = (id) => document.getElementById(id);
const unpacked = (text) => fflate.unzlibSync(new Uint8Array(_base64ToArrayBuffer(text.trim())));
const world = K3DInstance.getWorld();
// K3D itself does so some time later, and draws from amidst the objects until then.
K3DInstance.setCamera(K3DInstance.parameters.camera);
const objects = {};
Object.values(world.ObjectsListJson).forEach((json) => { objects[json.name] = json; });
let run, now = 0, timer = 0, busy = Promise.resolve();

function read(bytes) {
  const head = new DataView(bytes.buffer, bytes.byteOffset).getUint32(0, true);
  run = JSON.parse(fflate.strFromU8(bytes.subarray(4, 4 + head)));
  const kinds = { u1: Uint8Array, u2: Uint16Array, u4: Uint32Array };
  for (const [name, [kind, from, count]] of Object.entries(run.arrays)) {
    const start = 4 + head + from, size = kinds[kind].BYTES_PER_ELEMENT;
    run[name] = new kinds[kind](bytes.slice(start, start + size * count).buffer);
  }
  at('slider').max = run.touches;
}
const points = (name, from, to) => Float32Array.from(run[name].subarray(3 * from, 3 * to), (v, i) => run.low[i % 3] + run.scale * v);
function put(name, arrays) {
  const json = objects[name], on = at('on ' + name);
  Object.entries(arrays).forEach(([key, data]) => { json[key] = { data, shape: key === 'colors' ? [data.length] : [data.length / (key === 'indices' && name !== 'surface' && name !== 'planes' ? 2 : 3), 3] }; });
  json.visible = (!on || on.checked) && Object.values(arrays).every((data) => data.length > 0);
  return K3DInstance.reload(json, null, true);
}
function surface(t) {
  let m = run.mesh_touch.length - 1;
  while (m > 0 && run.mesh_touch[m] > t) m -= 1;
  if (m < 0 || run.mesh_touch[m] > t) return put('surface', { vertices: new Float32Array(0), indices: new Uint32Array(0) });
  const [a, b] = [run.vertex_from[m], run.vertex_from[m + 1]], [c, d] = [run.face_from[m], run.face_from[m + 1]];
  const mode = at('colour').value, palette = run.palettes[mode === 'face' || mode === 'patch' ? 'face' : 'scale'];
  return put('surface', {
    vertices: points('vertices', a, b), indices: Uint32Array.from(run.faces.subarray(3 * c, 3 * d)),
    colors: Uint32Array.from(run[mode].subarray(a, b), (v) => palette[v % palette.length]),
  });
}
function show(t) {
  now = Math.max(0, Math.min(t, run.touches));
  at('slider').value = now;
  const last = now === run.touches, plan = last ? now - 1 : now;
  at('words').textContent = run.words[now];
  document.querySelectorAll('svg').forEach((svg) => {
    const x = Number(svg.dataset.from) + (svg.dataset.to - svg.dataset.from) * Math.max(now - 1, 0) / run.steps;
    const line = svg.querySelector('.now'); line.setAttribute('x1', x); line.setAttribute('x2', x);
  });
  const pairs = run.pair_from[now];
  busy = busy.then(() => Promise.all([
    surface(now),
    put('contacts', { positions: points('contacts', 0, run.contact_from[now]) }),
    put('contours', { vertices: points('contours', 0, run.contour_from[now]), indices: run.pairs.slice(0, 2 * pairs) }),
    put('way', { vertices: points('ways', 2 * Math.max(now - 1, 0), 2 * now), indices: now ? Uint32Array.of(0, 1) : new Uint32Array(0) }),
    put('planes', last ? { vertices: new Float32Array(0), indices: new Uint32Array(0) } : {
      vertices: points('planes', run.plane_from[plan], run.plane_from[plan + 1]),
      indices: run.plane_faces.slice(0, 3 * (run.plane_from[plan + 1] - run.plane_from[plan]) / 2) }),
    put('open places', { positions: points('open', run.open_from[now], run.open_from[now + 1]) }),
    objects.truth && K3DInstance.reload(Object.assign(objects.truth, { visible: at('on truth').checked }), null, true),
  ])).then(() => K3DInstance.rebuildSceneData()).then(() => { K3DInstance.render(); document.body.dataset.shown = now; });
}
function play() {
  const stop = timer !== 0;
  clearInterval(timer); timer = 0;
  if (!stop) { if (now >= run.touches) show(0); timer = setInterval(() => (now < run.touches ? show(now + 1) : play()), 600); }
  at('play').textContent = timer ? 'stop' : 'play';
}
function theme() {
  const dark = matchMedia('(prefers-color-scheme: dark)').matches;
  K3DInstance.setClearColor(dark ? 0x14181c : 0xffffff);
  // K3D draws 10 to 100 lines a side; many of them would be a veil.
  const [a, b, c, d, e, f] = K3DInstance.parameters.grid, size = Math.max(d - a, e - b, f - c);
  const many = size / 10 ** (Math.ceil(Math.log10(size)) - 2) > 40;
  const grid = dark ? (many ? 0x1e2429 : 0x343c44) : (many ? 0xf1f3f5 : 0xd8dde2);
  // Set so, the grid is drawn once.
  Object.assign(K3DInstance.parameters, { labelColor: dark ? 0x98a3ad : 0x6b7680, gridColor: grid });
  return K3DInstance.rebuildSceneData(true);
}
function legend() {
  const mode = at('colour').value, hex = (c) => '#' + c.toString(16).padStart(6, '0');
  const dot = (words, colour) => `<span><i style="background:${colour}"></i>${words}</span>`;
  const scale = run.palettes.scale.filter((_, i) => i % 32 === 0).map(hex);
  const bar = `<span><span class="bar" style="background:linear-gradient(90deg,${scale})"></span>${mode} of the surface, 0 to ${run.tolerance}, the tolerance</span>`;
  const faces = run.face_words.map((words, i) => dot(words, hex(run.palettes.face[i % run.palettes.face.length]))).join('');
  const patches = dot('a colour for each patch', hex(run.palettes.face[0]));
  at('legend').innerHTML = ({ face: faces, patch: patches }[mode] || bar) + run.legend.map(([words, colour]) => dot(words, colour)).join('');
}
read(unpacked(at('run').textContent));
at('title').textContent = document.title = run.title;
at('colour').innerHTML = run.modes.map((mode) => `<option>${mode}</option>`).join('');
at('layers').innerHTML = run.layers.map((name) => `<label><input type="checkbox" id="on ${name}" checked> ${name}</label> `).join('');
at('slider').oninput = () => show(Number(at('slider').value));
at('play').onclick = play;
at('layers').onchange = () => show(now);
at('colour').onchange = () => { legend(); show(now); };
document.addEventListener('keydown', (event) => {
  if (event.target.tagName === 'SELECT') return;
  const to = { ArrowRight: now + 1, ArrowLeft: now - 1, Home: 0, End: run.touches }[event.key];
  if (to !== undefined) show(to); else if (event.key === ' ') play(); else return;
  event.preventDefault();
});
matchMedia('(prefers-color-scheme: dark)').onchange = () => { busy = busy.then(theme); show(now); };
busy = theme(); legend(); show(run.touches);
busy.then(() => { document.body.dataset.ready = 1; });
// A run that goes on is asked for again, until its process ends.
function follow() {
  fetch('run').then((answer) => answer.text()).then((text) => {
    const last = now === run.touches;
    read(unpacked(text));
    show(last ? run.touches : now);
    setTimeout(follow, 2000);
  }).catch(() => { at('words').textContent += '; the run has ended, and its folder has a replay.html'; });
}
if (run.live) setTimeout(follow, 2000);
