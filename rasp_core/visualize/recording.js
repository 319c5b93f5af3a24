/* Shows a recording (recording_format.py says what its data are): the objects, their shadows on the walls, sliders for
   the iteration and for what differs between runs, losses, overlap. Of a container's loading: the parts in their order
   instead, and neither shadows nor losses. A classic script, which file:// can load.

   raspRecording(element, data, THREE) fills an element; without three.js it draws on a plain canvas. It returns what
   tests drive: { show, choose, state, points, draw, silhouette }. Elements that hold their data are filled when the script runs. */
(() => {
  "use strict";
  const STEPS = 8191, ABSENT = -32768, FIELD = 0.32, RATE = 30, PIXELS = 256;
  const FREE = "#3b5bdb", MISSING = "#f08c00", WALL = "#f1f3f5", EDGE = "#3a4a5a";
  const COLOURS = { silhouette: "#1f77b4", overlap: "#d62728", extrusion: "#2ca02c" };

  // -- the data ------------------------------------------------------------------------------------------------------

  async function decode(data) {
    if (data.format !== "rasp-recording 1") throw new Error(`not a recording that is known here: ${data.format}`);
    const packed = Uint8Array.from(atob(data.data), (letter) => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
    const many = data.objects.length, kinds = data.losses.length;
    let count = 0;
    for (const [vertices, faces] of data.meshes) count += 3 * (vertices + faces);
    for (const run of data.runs) count += 7 * many * run.iterations.length;
    const whole = new Int16Array(count);
    for (let k = 0; k < count; k++) whole[k] = bytes[k] | (bytes[count + k] << 8);
    let at = 0;
    const take = (length) => whole.subarray(at, (at += length));
    const meshes = data.meshes.map(([vertices, faces, step]) => ({
      vertices: Float32Array.from(take(3 * vertices), (value) => value * step),
      faces: Uint16Array.from(take(3 * faces)),
    }));
    const runs = data.runs.map((run) => {
      const frames = run.iterations.length, poses = take(7 * many * frames);
      for (let k = 0; k < poses.length; k++) if (k % frames) poses[k] += poses[k - 1];
      return { ...run, frames, poses };
    });
    const floats = new Float32Array(bytes.slice(2 * count).buffer);
    let next = 0;
    for (const run of runs) {
      run.losses = floats.subarray(next, (next += run.frames * kinds));
      run.overlap = floats.subarray(next, (next += run.frames));
    }
    return { ...data, meshes, runs };
  }

  // Vertices of all objects at a frame, 3 numbers each; those of an object that is not there are in one point.
  function placer(recording) {
    const of = recording.objects.map(([, mesh]) => recording.meshes[mesh].vertices);
    const points = new Float32Array(of.reduce((sum, vertices) => sum + vertices.length, 0));
    const [cx, cy, cz, reach] = recording.place, pose = new Float64Array(7);
    return (run, frame) => {
      let out = 0;
      of.forEach((vertices, n) => {
        for (let k = 0; k < 7; k++) pose[k] = run.poses[(7 * n + k) * run.frames + frame];
        const scale = pose[0] === ABSENT ? 0 : 1, length = Math.hypot(pose[3], pose[4], pose[5], pose[6]);
        const w = pose[3] / length, x = pose[4] / length, y = pose[5] / length, z = pose[6] / length;
        const px = cx + (reach * pose[0]) / STEPS, py = cy + (reach * pose[1]) / STEPS, pz = cz + (reach * pose[2]) / STEPS;
        for (let v = 0; v < vertices.length; v += 3) {
          const a = scale * vertices[v], b = scale * vertices[v + 1], c = scale * vertices[v + 2];
          points[out++] = px + (1 - 2 * (y * y + z * z)) * a + 2 * (x * y - w * z) * b + 2 * (x * z + w * y) * c;
          points[out++] = py + 2 * (x * y + w * z) * a + (1 - 2 * (x * x + z * z)) * b + 2 * (y * z - w * x) * c;
          points[out++] = pz + 2 * (x * z - w * y) * a + 2 * (y * z + w * x) * b + (1 - 2 * (x * x + y * y)) * c;
        }
      });
      return points;
    };
  }

  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const add = (a, b, k = 1) => a.map((value, n) => value + k * b[n]);

  // What stays as it is: triangles and their colours, the container's corners and sharp edges, the walls.
  function fixed(recording) {
    const triangles = [], hues = [], ends = [0];
    let before = 0;
    for (const [, mesh, hue] of recording.objects) {
      const { vertices, faces } = recording.meshes[mesh], rgb = [1, 3, 5].map((k) => parseInt(hue.slice(k, k + 2), 16) / 255);
      for (const corner of faces) triangles.push(before + corner);
      for (let t = 0; t < faces.length / 3; t++) hues.push(rgb);
      before += vertices.length / 3;
      ends.push(hues.length);
    }
    const [number, centre] = recording.container, { vertices, faces } = recording.meshes[number];
    const place = (v) => add(centre, vertices.subarray(3 * v, 3 * v + 3));
    const shell = Array.from(faces, place), normals = new Map(), edges = [];
    for (let f = 0; f < faces.length; f += 3) {
      const across = cross(add(shell[f + 1], shell[f], -1), add(shell[f + 2], shell[f], -1));
      const unit = across.map((value) => value / (Math.hypot(...across) || 1));
      for (let k = 0; k < 3; k++) {
        const edge = [faces[f + k], faces[f + ((k + 1) % 3)]], key = edge.slice().sort().join();
        if (!normals.has(key)) normals.set(key, unit);
        else if (dot(normals.get(key), unit) < 0.866) edges.push(edge.map(place));
      }
    }
    const walls = (recording.loading ? [] : recording.views).map(([right, up, forward, middle, width]) => {
      const half = width / 2, at = add(middle, forward, half); // the far face of the viewing volume
      const quad = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([x, y]) => add(add(at, right, x * half), up, y * half));
      return { middle, forward, up, width, at, quad };
    });
    const [, , , middle, width] = recording.views[0];
    const aim = recording.loading ? 0.12 : -0.1; // parts come from above, shadows lie below
    return { triangles: Uint32Array.from(triangles), hues, ends, shell, edges, walls, middle, width, aim };
  }

  // The eye looks from azimuth and elevation, as the kit's cameras do, z up.
  function eyeOf(still, look) {
    const [c, s] = [Math.cos(look.azimuth), Math.sin(look.azimuth)], [d, t] = [Math.cos(look.elevation), Math.sin(look.elevation)];
    const right = [c, s, 0], forward = [-s * d, c * d, -t], middle = add(still.middle, [0, 0, still.aim * still.width]);
    return { right, up: cross(right, forward), forward, middle, at: add(middle, forward, -1.95 * still.width * look.distance) };
  }
  const seen = (wall, eye) => dot(add(wall.at, eye.at, -1), wall.forward) > 0;

  // The brightness of each triangle, by a lamp at the eye; 0 of those that are turned away.
  function lit(still, points, eye, bright) {
    const { triangles } = still, [ex, ey, ez] = eye.at, [fx, fy, fz] = eye.forward;
    for (let t = 0; t < bright.length; t++) {
      const a = 3 * triangles[3 * t], b = 3 * triangles[3 * t + 1], c = 3 * triangles[3 * t + 2];
      const x = points[a], y = points[a + 1], z = points[a + 2];
      const ux = points[b] - x, uy = points[b + 1] - y, uz = points[b + 2] - z;
      const vx = points[c] - x, vy = points[c + 1] - y, vz = points[c + 2] - z;
      const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
      const away = nx * (x - ex) + ny * (y - ey) + nz * (z - ez) >= 0;
      bright[t] = away ? 0 : 0.45 - (0.55 * (nx * fx + ny * fy + nz * fz)) / Math.sqrt(nx * nx + ny * ny + nz * nz);
    }
  }

  // -- with three.js: each view draws the objects onto a square of pixels, which is laid on its wall ----------------------

  // Without a graphics card smooth edges take longer than all else.
  function drawnByProcessor() {
    const gl = document.createElement("canvas").getContext("webgl2"), said = gl?.getExtension("WEBGL_debug_renderer_info");
    const name = said ? gl.getParameter(said.UNMASKED_RENDERER_WEBGL) : "";
    gl?.getExtension("WEBGL_lose_context")?.loseContext();
    return /swiftshader|llvmpipe|software/i.test(name);
  }

  const SHADER = {
    vertexShader: "varying vec2 at; void main() { at = uv; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }",
    fragmentShader: `varying vec2 at;
      uniform sampler2D shadow, wanted;
      uniform vec3 wall, free, missing;
      void main() {
        float s = texture2D(shadow, at).r, w = texture2D(wanted, at).r;
        gl_FragColor = vec4(mix(mix(wall, free, s), mix(missing, vec3(0.0), s), w), 1.0);
      }`,
    depthTest: false,
    depthWrite: false,
  };

  function withThree(THREE, canvas, still, points) {
    const renderer = new THREE.WebGLRenderer({ canvas, antialias: !drawnByProcessor() });
    renderer.setPixelRatio(globalThis.devicePixelRatio || 1);
    let size = "";
    const camera = new THREE.PerspectiveCamera(), count = still.hues.length, bright = new Float32Array(count);
    const geometry = (array) => new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(array, 3));
    const scene = (...meshes) => {
      for (const mesh of meshes) mesh.frustumCulled = false;
      return new THREE.Scene().add(...meshes);
    };
    const white = new THREE.MeshBasicMaterial({ depthTest: false }); // what faces the view is enough
    const vertices = geometry(points).setIndex(new THREE.BufferAttribute(still.triangles, 1));
    const objects = scene(new THREE.Mesh(vertices, white));
    const container = scene(new THREE.Mesh(geometry(new Float32Array(still.shell.flat())), white));
    const solid = geometry(new Float32Array(9 * count)); // each triangle by itself, in its own colour
    solid.setAttribute("color", new THREE.BufferAttribute(new Float32Array(9 * count), 3));
    const lines = new THREE.LineSegments(geometry(new Float32Array(still.edges.flat(2))), new THREE.LineBasicMaterial({ color: EDGE }));
    const stage = scene(new THREE.Mesh(solid, new THREE.MeshBasicMaterial({ vertexColors: true })), lines);
    stage.background = new THREE.Color("white");

    const onto = (target, held, view) => {
      renderer.setRenderTarget(target);
      renderer.render(held, view);
      renderer.setRenderTarget(null);
    };
    const walls = still.walls.map(({ middle, forward, up, width, quad }) => {
      const half = width / 2, view = new THREE.OrthographicCamera(-half, half, half, -half, -50 * width, 50 * width);
      view.up.set(...up);
      view.position.set(...middle);
      view.lookAt(...add(middle, forward));
      const [shadow, wanted] = [0, 1].map(() => new THREE.WebGLRenderTarget(PIXELS, PIXELS, { depthBuffer: false }));
      onto(wanted, container, view);
      const colours = { wall: WALL, free: FREE, missing: MISSING }, uniforms = { shadow: { value: shadow.texture }, wanted: { value: wanted.texture } };
      for (const [name, hue] of Object.entries(colours)) uniforms[name] = { value: new THREE.Color(hue) };
      const square = geometry(new Float32Array(quad.flat())).setIndex([0, 1, 2, 0, 2, 3]);
      square.setAttribute("uv", new THREE.BufferAttribute(new Float32Array([0, 0, 1, 0, 1, 1, 0, 1]), 2));
      const mesh = new THREE.Mesh(square, new THREE.ShaderMaterial({ ...SHADER, uniforms }));
      mesh.renderOrder = -1;
      stage.add(mesh);
      return { mesh, view, shadow };
    });

    function draw(eye, moved) {
      const wide = canvas.clientWidth || 640, high = canvas.clientHeight || 480;
      if (wide + "," + high !== size) renderer.setSize(wide, high, false); // which makes a new canvas
      size = wide + "," + high;
      Object.assign(camera, { aspect: wide / high, fov: (360 / Math.PI) * Math.atan(FIELD), near: still.width / 50, far: still.width * 60 });
      camera.up.set(...eye.up);
      camera.position.set(...eye.at);
      camera.lookAt(...eye.middle);
      camera.updateProjectionMatrix();
      const { position, color } = solid.attributes;
      lit(still, points, eye, bright);
      for (let t = 0, out = 0; t < count; t++) {
        for (let k = 0; k < 3; k++) {
          const from = 3 * still.triangles[3 * t + k];
          for (let axis = 0; axis < 3; axis++, out++) {
            position.array[out] = points[from + axis];
            color.array[out] = still.hues[t][axis] * bright[t];
          }
        }
      }
      position.needsUpdate = color.needsUpdate = vertices.attributes.position.needsUpdate = true;
      walls.forEach(({ mesh, view, shadow }, n) => {
        if (moved) onto(shadow, objects, view);
        mesh.visible = seen(still.walls[n], eye);
      });
      renderer.render(stage, camera);
    }

    // What a view sees, from the bottom row up: 255 where there is an object.
    draw.silhouette = (n) => {
      const pixels = new Uint8Array(4 * PIXELS * PIXELS);
      renderer.readRenderTargetPixels(walls[n].shadow, 0, 0, PIXELS, PIXELS, pixels);
      return pixels.filter((_, k) => k % 4 === 0);
    };
    return draw;
  }

  // -- without: triangles from far to near on a plain canvas -----------------------------------------------------------

  function withCanvas(canvas, still, points) {
    const pen = canvas.getContext("2d"), { triangles, hues, ends } = still, bright = new Float32Array(hues.length);
    const order = Uint32Array.from(hues.keys()), depth = new Float32Array(hues.length), all = points.length / 3;
    const x = new Float32Array(all), y = new Float32Array(all), z = new Float32Array(all);
    const triangle = (t) => {
      const [a, b, c] = triangles.subarray(3 * t, 3 * t + 3);
      pen.moveTo(x[a], y[a]);
      pen.lineTo(x[b], y[b]);
      pen.lineTo(x[c], y[c]);
      pen.closePath();
    };
    const area = (t) => {
      const [a, b, c] = triangles.subarray(3 * t, 3 * t + 3);
      return (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a]);
    };
    return (eye) => {
      const wide = (canvas.width = canvas.clientWidth || 640), high = (canvas.height = canvas.clientHeight || 480);
      const project = (p) => {
        const d = add(p, eye.at, -1), far = dot(d, eye.forward), scale = high / 2 / FIELD / far;
        return [wide / 2 + scale * dot(d, eye.right), high / 2 - scale * dot(d, eye.up), far];
      };
      const polygon = (path, corners) => {
        corners.forEach((p, k) => (k ? path.lineTo(p[0], p[1]) : path.moveTo(p[0], p[1])));
        path.closePath();
      };
      const projectAll = (onto) => {
        for (let v = 0; v < all; v++) [x[v], y[v], z[v]] = project(onto(points.subarray(3 * v, 3 * v + 3)));
      };
      const shadows = (hue) => {
        pen.fillStyle = hue;
        for (let n = 0; n + 1 < ends.length; n++) {
          pen.beginPath(); // an object's triangles that face one way cover its shadow
          for (let t = ends[n]; t < ends[n + 1]; t++) if (area(t) > 0) triangle(t);
          pen.fill();
        }
      };
      for (const wall of still.walls.filter((wall) => seen(wall, eye))) {
        const onto = (p) => add(p, wall.forward, dot(wall.forward, wall.at) - dot(wall.forward, p));
        const back = new Path2D(), target = new Path2D();
        polygon(back, wall.quad.map(project));
        for (let f = 0; f < still.shell.length; f += 3) {
          const [a, b, c] = still.shell.slice(f, f + 3).map((p) => project(onto(p)));
          if ((b[0] - a[0]) * (c[1] - a[1]) > (b[1] - a[1]) * (c[0] - a[0])) polygon(target, [a, b, c]);
        }
        projectAll(onto);
        pen.fillStyle = WALL;
        pen.fill(back);
        pen.save();
        pen.clip(back);
        shadows(FREE);
        pen.clip(target);
        pen.fillStyle = MISSING;
        pen.fill(target);
        shadows("black");
        pen.restore();
      }
      projectAll((p) => p);
      lit(still, points, eye, bright);
      for (let t = 0; t < hues.length; t++) depth[t] = z[triangles[3 * t]] + z[triangles[3 * t + 1]] + z[triangles[3 * t + 2]];
      order.sort((a, b) => depth[b] - depth[a]);
      for (const t of order) {
        if (!bright[t]) continue;
        pen.fillStyle = pen.strokeStyle = `rgb(${hues[t].map((value) => Math.round(255 * value * bright[t]))})`;
        pen.beginPath();
        triangle(t);
        pen.fill();
        pen.stroke(); // no seams
      }
      pen.strokeStyle = EDGE;
      pen.beginPath();
      for (const [a, b] of still.edges.map((edge) => edge.map(project))) pen.moveTo(a[0], a[1]), pen.lineTo(b[0], b[1]);
      pen.stroke();
    };
  }

  // -- the page ----------------------------------------------------------------------------------------------------------

  const STYLE = `
    .rasp-recording { font: 13px/1.4 sans-serif; color: #222; background: #fff; display: flex; flex-wrap: wrap; gap: 12px; padding: 8px; }
    .rasp-recording canvas { flex: 3 1 320px; min-width: 0; width: 320px; height: 430px; touch-action: none; cursor: grab; }
    .rasp-recording .side { flex: 1 1 220px; max-width: 340px; overflow-wrap: anywhere; }
    .rasp-recording label { display: block; margin: 4px 0; }
    .rasp-recording input { width: 100%; margin: 0; }
    .rasp-recording svg { width: 100%; height: 52px; display: block; border: 1px solid #ccc; box-sizing: border-box; background: #fff; }
    .rasp-recording ol { max-height: 330px; overflow: auto; margin: 6px 0; padding-left: 34px; }
    .rasp-recording li { cursor: pointer; border-left: 8px solid; padding-left: 6px; margin: 1px 0; }
    .rasp-recording li.later { opacity: 0.35; }
    .rasp-recording li.now { font-weight: bold; }
    .rasp-recording i { font-style: normal; font-weight: bold; }`;

  function node(tag, parent, inner = "") {
    const made = document.createElement(tag);
    made.innerHTML = inner;
    parent.append(made);
    return made;
  }

  const number = (value) => (Number.isFinite(value) ? String(+value.toPrecision(3)) : "-");

  function curve(values, hue) {
    const known = values.filter(Number.isFinite), low = Math.min(0, ...known), span = Math.max(...known) - low || 1;
    const at = (value, k) => `${(100 * k) / (values.length - 1)},${49 - (46 * (value - low)) / span}`;
    const points = values.map((value, k) => (Number.isFinite(value) ? at(value, k) : "")).join(" ");
    const line = `fill="none" vector-effect="non-scaling-stroke"`;
    return `<svg viewBox="0 0 100 52" preserveAspectRatio="none">
      <polyline ${line} stroke="${hue}" stroke-width="1.5" points="${points}"/><path ${line} stroke="#888" d="M0,0V52"/></svg>`;
  }

  async function raspRecording(element, data, THREE) {
    const recording = await decode(data), place = placer(recording), still = fixed(recording), varied = Object.entries(data.varied);
    element.replaceChildren();
    element.classList.add("rasp-recording");
    node("style", element, STYLE);
    const canvas = node("canvas", element), side = node("div", element);
    side.className = "side";
    const state = { run: 0, frame: 0 }, look = { azimuth: 0.6, elevation: 0.42, distance: 1 };
    const points = place(recording.runs[0], 0);
    let stage = null;
    try {
      stage = THREE && withThree(THREE, canvas, still, points);
    } catch (error) { // no WebGL here
      stage = null;
    }
    stage = stage || withCanvas(canvas, still, points);
    const draw = (moved) => stage(eyeOf(still, look), moved);

    const play = node("button", side, "Play"), time = node("label", side), words = node("span", time);
    const loading = recording.loading, slider = node("input", time);
    Object.assign(slider, { type: "range", min: 0, value: 0, name: loading ? "step" : "iteration" });
    const sliders = varied.map(([name, values]) => {
      const label = node("label", side), said = node("span", label);
      const input = Object.assign(node("input", label), { type: "range", min: 0, max: values.length - 1, name });
      return { name, values, said, input };
    });
    const facts = node("div", side);
    const curves = (loading ? [] : ["silhouette", "overlap", "extrusion"]).map((name) => {
      const title = node("div", side);
      const svg = node("div", side), column = data.losses.indexOf(name);
      return { name, title, svg, column };
    });
    const parts = loading ? listed() : [];
    if (!loading) node("p", side, `Shadows: black as wanted, <i style="color:${MISSING}">orange</i> missing, <i style="color:${FREE}">blue</i> too much.`);

    // The parts in their order, each in its colour; a click, and the buttons, show one in its place.
    function listed() {
      for (const [label, next] of [["Back", false], ["Next", true]]) {
        const button = node("button", play.parentElement, label), { stops } = loading;
        play.parentElement.insertBefore(button, time);
        button.addEventListener("click", () => {
          pause();
          show(next ? stops.find((stop) => stop > state.frame) ?? state.frame : stops.findLast((stop) => stop < state.frame) ?? 0);
        });
      }
      const list = node("ol", side), hues = Object.fromEntries(recording.objects.map(([name, , hue]) => [name, hue]));
      return loading.stops.map((stop, k) => {
        const item = node("li", list);
        item.textContent = loading.words[k];
        item.style.borderColor = hues[loading.names[k]];
        item.addEventListener("click", () => (pause(), show(stop)));
        return item;
      });
    }

    function tell() {
      const now = loading.stops.findIndex((stop) => stop >= state.frame), many = loading.stops.length;
      words.textContent = state.frame ? `${now + 1} of ${many}: ${loading.words[now]}` : `${many} parts to load`;
      parts.forEach((item, k) => {
        item.className = k === now && state.frame ? "now" : loading.stops[k] > state.frame ? "later" : "";
      });
      const item = parts[now], list = item?.parentElement;
      if (list) list.scrollTop = item.offsetTop - list.offsetTop - list.clientHeight / 2;
    }

    function show(frame) {
      const run = recording.runs[state.run];
      state.frame = Math.max(0, Math.min(run.frames - 1, Math.round(frame)));
      Object.assign(slider, { max: run.frames - 1 });
      slider.value = state.frame;
      place(run, state.frame);
      let there = 0;
      for (let at = state.frame; at < run.poses.length; at += 7 * run.frames) there += run.poses[at] !== ABSENT;
      if (loading) tell();
      else words.textContent = `iteration ${run.iterations[state.frame]} of ${run.total}, ${there} objects`;
      sliders.forEach(({ name, values, said, input }) => {
        const value = run.values[varied.findIndex(([other]) => other === name)];
        input.value = values.indexOf(value);
        said.textContent = `${name}: ${number(value)}`;
      });
      if (!loading) facts.textContent = `${number(100 * run.overlap[state.frame])} % of the container is filled twice`;
      for (const one of curves) {
        if (one.run !== run) {
          one.values = Array.from({ length: run.frames }, (_, k) => run.losses[k * data.losses.length + one.column]);
          one.svg.innerHTML = curve(one.values, COLOURS[one.name]);
          one.marker = one.svg.querySelector("path");
          one.run = run;
        }
        one.title.textContent = `${one.name} loss ${number(one.values[state.frame])}`;
        one.marker.setAttribute("transform", `translate(${(100 * state.frame) / (run.frames - 1)})`);
      }
      draw(true);
    }

    function choose(indices) {
      const before = recording.runs[state.run], share = state.frame / Math.max(before.frames - 1, 1);
      const wanted = varied.map(([, values], k) => values[indices[k]]);
      state.run = recording.runs.findIndex((run) => run.values.every((value, k) => value === wanted[k]));
      show(share * (recording.runs[state.run].frames - 1));
    }

    let playing = 0, last = 0;
    function advance(now) {
      if (!playing) return;
      playing = requestAnimationFrame(advance);
      if (now - last < 1000 / RATE - 4) return;
      last = now;
      show(state.frame + 1);
      if (state.frame === recording.runs[state.run].frames - 1) pause();
    }
    function pause() {
      cancelAnimationFrame(playing);
      playing = 0;
      play.textContent = "Play";
    }
    play.addEventListener("click", () => {
      if (playing) return pause();
      if (state.frame === recording.runs[state.run].frames - 1) show(0);
      play.textContent = "Pause";
      playing = requestAnimationFrame(advance);
    });
    slider.addEventListener("input", () => (pause(), show(+slider.value)));
    sliders.forEach(({ input }) => input.addEventListener("input", () => choose(sliders.map((other) => +other.input.value))));
    canvas.addEventListener("pointermove", (event) => {
      if (!event.buttons) return;
      look.azimuth -= event.movementX / 150;
      look.elevation = Math.max(-1.5, Math.min(1.5, look.elevation + event.movementY / 150));
      draw();
    });
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      look.distance = Math.max(0.2, Math.min(4, look.distance * Math.exp(event.deltaY / 1000)));
      draw();
    }, { passive: false });
    new ResizeObserver(() => draw()).observe(canvas);
    show(Infinity);
    return (element.recording = { show, choose, state, points, draw, silhouette: stage.silhouette });
  }

  globalThis.raspRecording = raspRecording;
  for (const element of document.querySelectorAll(".rasp-recording:not([data-shown])")) {
    const held = element.querySelector("script[type='application/json']");
    element.dataset.shown = "";
    if (held) raspRecording(element, JSON.parse(held.textContent), globalThis.THREE);
  }
})();
