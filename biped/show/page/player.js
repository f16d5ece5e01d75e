"use strict";
// Walks drawn from the numbers in the page: pictures of joints, forces and leg states (biped/show/page/frames.py).
(() => {
  const STATES = ["", "stance", "heel off", "swing", "knee straight"];
  const FRONT = 1.0;

  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
  const whole = (text) => {
    const view = new DataView(bytes(text));
    return Array.from({ length: view.byteLength / 2 }, (_, i) => view.getInt16(2 * i, true));
  };
  const real = (text) => {
    const view = new DataView(bytes(text));
    return Array.from({ length: view.byteLength / 4 }, (_, i) => view.getFloat32(4 * i, true));
  };

  class Walk {
    constructor(root) {
      const data = JSON.parse(root.dataset.walk);
      Object.assign(this, data, {
        root, base: real(data.base), place: whole(data.place), force: whole(data.force),
        state: new Uint8Array(bytes(data.state)), frame: 0, playing: null,
      });
      this.ghosts = this.ghosts.map((ghost) => ({ ...ghost, points: 11, base: real(ghost.base), place: whole(ghost.place) }));
      this.largest = Math.max(1e-9, ...this.pushes.map((push) => Math.hypot(...push.slice(2))));
      this.parts = Object.fromEntries([...root.querySelectorAll("[data-part]")].map((part) => [part.dataset.part, part]));
      this.cursors = root.querySelectorAll(".cursor");
      this.legs = root.dataset.legs.split("|");
      const { play, scrub, speed } = this.parts;
      scrub.addEventListener("input", () => { this.stop(); this.show(Number(scrub.value)); });
      play.addEventListener("click", () => (this.playing === null ? this.start_() : this.stop()));
      speed.addEventListener("change", () => { if (this.playing !== null) { this.stop(); this.start_(); } });
      this.views = [...root.querySelectorAll("[data-view]")];
      for (const view of this.views) view.addEventListener("click", () => { this.look(view); this.show(this.frame); });
      this.look(this.views[0]);
      this.show(0);
    }

    // The camera: azimuth from the robot's right by what is ahead of it, and elevation; no perspective.
    look(view) {
      const [a, e] = (view ? view.dataset.view : "0,0").split(",").map((angle) => (Number(angle) * Math.PI) / 180);
      this.across = [Math.cos(a), Math.sin(a), 0];
      this.down = [Math.sin(a) * Math.sin(e), -Math.cos(a) * Math.sin(e), -Math.cos(e)];
      const side = a === 0 && e === 0;
      for (const one of this.views) one.setAttribute("aria-pressed", String(one === view));
      this.parts.ground.style.display = side ? "" : "none";
      const line = (points) => `M${points.map((point) => this.seen(point).map((v) => v.toFixed(3)).join(" ")).join("L")}`;
      this.parts.floor.setAttribute("d", side ? "" : this.floor.map(line).join(""));
    }

    // A vector in the drawing: metres to the right and down.
    seen(vector) {
      return [this.across, this.down].map((axis) => axis[0] * vector[0] + axis[1] * vector[1] + axis[2] * vector[2]);
    }

    // A point of a picture in the drawing, of this walk or of a ghost.
    point(i, walk = this, frame = this.frame) {
      const at = 3 * (walk.points * frame + i), below = 3 * frame;
      return this.seen([0, 1, 2].map((k) => walk.base[below + k] + walk.place[at + k] * this.unit));
    }

    // Legs and trunk of points in the drawing; parts of a ghost begin with its name.
    figure(all, name = "") {
      const line = (points) => points.map((point) => point.map((v) => v.toFixed(4)).join(",")).join(" ");
      for (const [leg, first] of [["first", 0], ["second", 5]]) {
        const order = [first, first + 1, first + 2, first + 4, first + 3, first + 2];
        this.parts[name + leg].setAttribute("points", line(order.map((i) => all[i])));
      }
      const hip = [0, 1].map((k) => 0.5 * (all[0][k] + all[5][k]));
      this.parts[`${name}trunk`].setAttribute("points", line([all[0], all[5], hip, all[10]]));
      return hip;
    }

    show(frame) {
      this.frame = Math.min(this.n - 1, Math.max(0, Math.round(frame)));
      const all = Array.from({ length: this.points }, (_, i) => this.point(i));
      const corners = (...which) => which.map((i) => all[i].map((v) => v.toFixed(4)).join(",")).join(" ");
      const hip = this.figure(all), top = all[10];
      const long = Math.hypot(top[0] - hip[0], top[1] - hip[1]) || 1;
      this.ghosts.forEach((ghost, i) => {
        const at = this.frame + Math.round((this.start - ghost.start) / this.dt);
        const frame = Math.min(ghost.n - 1, Math.max(0, at));  // who has fallen lies where it fell
        this.figure(Array.from({ length: ghost.points }, (_, point) => this.point(point, ghost, frame)), `ghost${i}`);
      });
      this.arms.forEach((arm, i) => this.parts[`arm${i}`].setAttribute("points", corners(...arm)));
      this.put("head", top[0] + (0.17 * this.leg * (top[0] - hip[0])) / long, top[1] + (0.17 * this.leg * (top[1] - hip[1])) / long);
      this.put("centre", ...all[11]);
      const below = this.seen(this.base.slice(3 * this.frame, 3 * this.frame + 3));
      this.parts.world.setAttribute("transform", `translate(${(-below[0]).toFixed(4)} ${(-below[1]).toFixed(4)})`);
      [3, 4, 8, 9].forEach((i, point) => {
        const at = 3 * (4 * this.frame + point);
        this.arrow(`force${point}`, all[i], this.seen([0, 1, 2].map((k) => this.force[at + k] / 1000)), 0.65 * this.leg);
      });
      this.push(hip, top);
      this.trail();
      const time = this.start + this.frame * this.dt;
      this.parts.scrub.value = String(this.frame);
      this.parts.time.textContent = `${time.toFixed(2)} s`;
      this.parts.readout.textContent = this.legs.map((leg, i) => `${leg}: ${STATES[this.state[2 * this.frame + i]] ?? ""}`).join(" · ");
      const x = this.n > 1 ? (1000 * this.frame) / (this.n - 1) : 0;
      for (const cursor of this.cursors) { cursor.setAttribute("x1", x); cursor.setAttribute("x2", x); }
    }

    put(part, x, y) {
      this.parts[part].setAttribute("cx", x.toFixed(4));
      this.parts[part].setAttribute("cy", y.toFixed(4));
    }

    arrow(part, from, way, scale) {
      const length = Math.hypot(...way) * scale;
      if (length < 0.012) { this.parts[part].setAttribute("d", ""); return; }
      const to = [from[0] + way[0] * scale, from[1] + way[1] * scale];
      const [a, b] = way.map((v) => (v * scale) / length), tip = Math.min(0.07, 0.5 * length);
      const barb = (side) => `${(to[0] - tip * (a - side * 0.5 * b)).toFixed(4)} ${(to[1] - tip * (b + side * 0.5 * a)).toFixed(4)}`;
      this.parts[part].setAttribute("d", `M${from.map((v) => v.toFixed(4)).join(" ")}L${to.map((v) => v.toFixed(4)).join(" ")}M${barb(1)}L${to[0].toFixed(4)} ${to[1].toFixed(4)}L${barb(-1)}`);
    }

    // The push that acts now: an arrow that ends at the trunk, or a ring where it goes along the line of sight.
    push(hip, top) {
      const time = this.start + this.frame * this.dt;
      const now = this.pushes.find(([from, to]) => time >= from - 1e-9 && time < to - 1e-9);
      const force = now ? now.slice(2) : [0, 0, 0], size = Math.hypot(...force);
      if (size === 0) {
        this.parts.push.setAttribute("d", "");
        this.parts.said.textContent = "";
        return;
      }
      const middle = [0, 1].map((k) => hip[k] + 0.63 * (top[k] - hip[k]));
      const long = (this.leg * (0.25 + (0.4 * size) / this.largest)) / size;
      const way = this.seen(force).map((v) => v * long), from = middle.map((v, k) => v - way[k]);
      this.arrow("push", from, way, 1);
      const drawn = Math.hypot(...way), ring = drawn < 0.1 * this.leg;
      if (ring) {
        const r = 0.07 * this.leg;
        this.parts.push.setAttribute("d", `M${middle[0] - r} ${middle[1]}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0`);
      }
      const words = [["forward", "backward"], ["left", "right"], ["up", "down"]];
      const main = [0, 1, 2].reduce((best, k) => (Math.abs(force[k]) > Math.abs(force[best]) ? k : best), 0);
      this.parts.said.textContent = `${size.toFixed(0)} N ${words[main][force[main] < 0 ? 1 : 0]}`;
      const at = ring ? [0.5 * this.leg, 0] : [(-0.3 * this.leg * way[0]) / drawn, ((-0.2 * way[1]) / drawn - 0.1) * this.leg];
      this.parts.said.setAttribute("x", (from[0] + at[0]).toFixed(4));
      this.parts.said.setAttribute("y", (from[1] + at[1]).toFixed(4));
      this.parts.said.setAttribute("text-anchor", "middle");
    }

    trail() {
      const kept = this.frame, first = Math.max(0, kept - 80), path = [];
      for (this.frame = first; this.frame <= kept; this.frame += 1) path.push(this.point(11).map((v) => v.toFixed(3)).join(" "));
      this.frame = kept;
      this.parts.trail.setAttribute("d", `M${path.join("L")}`);
    }

    start_() {
      if (this.frame >= this.n - 1) this.show(0);
      const first = this.frame, speed = Number(this.parts.speed.value) || FRONT;
      let began = null;
      const next = (now) => {
        began ??= now;
        this.show(first + ((now - began) / 1000) * (speed / this.dt));
        if (this.frame >= this.n - 1) { this.stop(); return; }
        this.playing = requestAnimationFrame(next);
      };
      this.playing = requestAnimationFrame(next);
      this.label("Pause", "❚❚");
    }

    stop() {
      if (this.playing !== null) cancelAnimationFrame(this.playing);
      this.playing = null;
      this.label("Play", "▶");
    }

    label(words, sign) {
      this.parts.play.setAttribute("aria-label", words);
      this.parts.play.textContent = sign;
    }
  }

  document.body.classList.add("live");
  for (const group of document.querySelectorAll(".walks")) {
    const panels = [...group.querySelectorAll(".walk")], tabs = [...group.querySelectorAll("[role=tab]")];
    const walks = panels.map((panel) => new Walk(panel));
    const choose = (chosen) => {
      tabs.forEach((tab, i) => tab.setAttribute("aria-selected", String(i === chosen)));
      panels.forEach((panel, i) => { panel.hidden = i !== chosen; if (i !== chosen) walks[i].stop(); });
    };
    tabs.forEach((tab, i) => tab.addEventListener("click", () => choose(i)));
    choose(0);
  }
})();
