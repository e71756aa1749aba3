#include "common/text.h"
#include "server/lab/stability/contact_trial.h"
#include "server/lab/stability/row.h"

#include <algorithm>
#include <cmath>
#include <numbers>

// Rows about bodies on each other: mass ratios, tunnelling, rest, friction, islands.
namespace crumple::lab::stability {
namespace {

constexpr double kGravity = 9.81;  // [m/s^2]

Outcome mass_ratio(const Method& method, const Effort& effort) {
  bool sound = true, stands = true;
  double worst = 0;
  std::string found = "deepest overlap in % of the thickness, ratio";
  for (const double ratio : {10.0, 100.0, 1e3, 1e4}) {
    if (effort.brief && (ratio == 10 || ratio == 1e3)) continue;
    const HeavyOnLight result = heavy_on_light(method.contact, ratio, 1.0 / 60, effort.brief ? 1.5 : 3);
    sound = sound && result.sound;
    stands = stands && !result.fell && result.inverted == 0;
    worst = std::max(worst, result.penetration);
    found += text(" ", ratio, ": ", 100 * result.penetration, result.fell ? " (sunk or fallen)" : "",
                  result.inverted > 0 ? " (inverted)" : "", ";");
  }
  return judged(sound, stands && worst < 0.05, worst, found);
}

Outcome tunnelling(const Method& method, const Effort& effort) {
  const int phases = effort.brief ? 3 : 10;
  int cube = 0, disc = 0;
  bool sound = true;
  double rebound = 0;
  for (int k = 0; k < phases; ++k) {
    const double phase = static_cast<double>(k) / phases;
    const Shot a = shot_at_plate(method.contact, {1, 1, 1}, 1000, 0.01, 1.0 / 60, phase);
    const Shot b = shot_at_plate(method.contact, {1, 0.01, 1}, 1000, 0.01, 1.0 / 60, phase);
    cube += a.behind;
    disc += b.behind;
    sound = sound && a.sound && b.sound;
    rebound = std::max({rebound, a.rebound, b.rebound});
  }
  const std::string found = text("of ", phases, " shots at 1000 m/s a cube passes ", cube, ", a disc of 1 cm face-on ",
                                 disc, "; rebound up to ", rebound, " of the speed");
  if (sound && cube + disc > 0) return {Verdict::fails, (cube + disc) / (2.0 * phases), found};
  return judged(sound, rebound < 1, rebound, found);
}

Outcome deep_overlap(const Method& method, const Effort&) {
  ContactTrial trial(method.contact);
  trial.scene.gravity.setZero();
  const BodyId a = trial.add_block({.centre = {0, 0, 0}}), b = trial.add_block({.centre = {0.5, 0.05, 0.02}});
  trial.start();
  double fastest = 0;
  trial.run(4, [&](const sim::StepReport&) {
    fastest = std::max({fastest, trial.rms_speed(a), trial.rms_speed(b)});
    return true;
  });
  const double apart = (trial.centre(b) - trial.centre(a)).cwiseAbs().maxCoeff();
  return judged(
      trial.sound(), fastest < 2 && trial.inverted() == 0, fastest,
      text("fastest ", fastest, " m/s; ",
           apart > 0.95 ? "the cubes part" : text("centres ", apart, " m apart after 4 s: they stay overlapped"), "; ",
           trial.inverted(), " inverted"));
}

struct Rest {
  bool sound = true;
  double rms = 0;    // largest after 5 s [m/s]
  double flips = 0;  // sign changes of a body's vertical velocity above 0.1 mm/s [1/s]
  double drift = 0;  // of the top block from where it was at 5 s [m]
};

Rest rest(const Method& method, int count, double young, double seconds) {
  ContactTrial trial(method.contact);
  trial.add_ground();
  for (int k = 0; k < count; ++k) trial.add_block({.centre = {0, 0.5 + k, 0}, .young = young});
  trial.start();
  Rest result;
  trial.run(5);
  const BodyId top = trial.blocks.back();
  const Vec3 at = trial.centre(top);
  double last = 0;
  int flips = 0;
  trial.run(seconds - 5, [&](const sim::StepReport&) {
    for (const BodyId body : trial.blocks) result.rms = std::max(result.rms, trial.rms_speed(body));
    const double v = trial.velocity(top).y();
    if (std::abs(v) > 1e-4) {
      flips += v * last < 0;
      last = v;
    }
    return true;
  });
  result.sound = trial.sound();
  result.flips = flips / (seconds - 5);
  result.drift = (trial.centre(top) - at).norm();
  return result;
}

Outcome resting(const Method& method, const Effort& effort) {
  const int high = method.contact.rigid ? 10 : 5;
  const Rest block = rest(method, 1, 1e6, effort.brief ? 8 : 60),
             stack = rest(method, high, 1e8, effort.brief ? 7 : 20);
  const double worst = std::max(block.rms, stack.rms);
  return judged(block.sound && stack.sound, worst < 1e-3 && stack.flips < 1 && block.flips < 1, worst,
                text("rms speed of a block ", 1000 * block.rms, " mm/s, of a stack of ", high, " ", 1000 * stack.rms,
                     " mm/s, top flips ", stack.flips, " times a second and drifts ", 1000 * stack.drift, " mm"));
}

Outcome creep_sink(const Method& method, const Effort& effort) {
  ContactTrial trial(method.contact);
  trial.add_ground();
  const BodyId body = trial.add_block({.centre = {0, 0.4999, 0}, .young = 1e8});
  trial.start();
  trial.run(2);
  const double from = trial.centre(body).y(), seconds = effort.brief ? 1 : 6;
  trial.run(seconds);
  const double sink = std::max(0.0, from - trial.centre(body).y()) / seconds;
  std::string found = text("sinks at ", 1000 * sink, " mm/s, ", 60e3 * sink, " mm in a minute");
  if (method.contact.settings.raw_damping)
    found += text("; m g/(phi A) = ", 1000 * 1000 * kGravity / method.contact.settings.phi, " mm/s");
  return judged(trial.sound(), 60 * sink < 1e-3, sink, found);
}

Outcome slope(const Method& method, const Effort& effort) {
  const auto tilted = [&](double degrees) {
    ContactTrial trial(method.contact);
    const double a = degrees * std::numbers::pi / 180;
    trial.scene.gravity = kGravity * Vec3(std::sin(a), -std::cos(a), 0);
    trial.add_ground();
    trial.add_block({.size = {1, 0.5, 1}, .centre = {0, 0.25, 0}, .young = 1e8});
    trial.start();
    return trial;
  };
  const double seconds = effort.brief ? 3 : 10;
  ContactTrial holds = tilted(26.0), slides = tilted(27.1), steep = tilted(30);
  holds.run(2);
  const double from = holds.centre(holds.blocks[0]).x();
  holds.run(seconds);
  const double drift = std::abs(holds.centre(holds.blocks[0]).x() - from) * 10 / seconds;
  slides.run(3);
  steep.run(1);
  const double v = steep.velocity(steep.blocks[0]).x();
  steep.run(1);
  const double slid = slides.centre(slides.blocks[0]).x(), a = steep.velocity(steep.blocks[0]).x() - v;
  return judged(holds.sound() && slides.sound() && steep.sound(), drift < 1e-3 && slid > 0.1, drift,
                text("at 26.0 degrees drifts ", 1000 * drift, " mm in 10 s; at 27.1 slides ", slid,
                     " m in 3 s; at 30 accelerates ", a, " m/s^2 (0.657)"));
}

Outcome wake(const Method& method, const Effort& effort) {
  ContactTrial trial(method.contact);
  trial.add_ground();
  const int count = effort.brief ? 8 : 20;
  for (int k = 0; k < count; ++k)
    trial.add_block({.size = Vec3::Constant(0.5), .centre = {0.501 * k, 0.25, 0}, .cells = {1, 1, 1}, .young = 1e7});
  trial.start();
  trial.run(2);
  const double quiet = trial.energy();
  const double mass = 1000 * 0.125, push = 2 * mass;  // 2 m/s
  (void)trial.world->submit(sim::ApplyImpulse{
      .body = trial.blocks[0], .impulse = {push, 0, 0}, .point = trial.centre(trial.blocks[0]), .radius = 1});
  trial.run(trial.scene.dt);
  const double poked = std::max(trial.energy(), quiet);
  double highest = poked;
  trial.run(3, [&](const sim::StepReport&) {
    highest = std::max(highest, trial.energy());
    return true;
  });
  const double gain = (highest - poked) / (0.5 * push * push / mass);
  bool airborne = false;
  for (const BodyId body : trial.blocks) airborne = airborne || trial.lowest(body) > 0.02;
  return judged(trial.sound(), gain < 0.01 && !airborne, gain,
                text("energy rises by ", 100 * gain, " % of the poke's at most; ",
                     airborne ? "a block hangs in the air" : "no block hangs in the air"));
}

}  // namespace

std::vector<Row> contact_rows() {
  const Missing heuristic{"friction by the paper's heuristic",
                          "F_n = M G mu r_y alpha of the composite island, as an option"};
  return {
      {16,
       "Mass ratio to 1e4 : 1",
       "A block of 10 to 1e4 times the density on a light one, E = 1e9, 3 s",
       "bounded, stands, overlap < 5 % of the thickness",
       Family::contact,
       mass_ratio,
       3,
       {{"glued bodies", "ties or joints between bodies"}}},
      {18,
       "Tunnelling at 1000 m/s",
       "A cube of 1 m and a disc of 1 x 0.01 m face-on against a fixed plate of 1 cm, dt = 1/60 s, ten phases of the "
       "step",
       "never ends on the far side",
       Family::contact,
       tunnelling,
       1,
       {{"continuous collision detection", "time of impact for soft bodies; a fast spin is not looked at"}}},
      {19, "Initial deep overlap", "Two cubes of 1 m overlapping by half, no gravity, 4 s",
       "fastest < 2 m/s, nothing inverted; damping contact never parts them", Family::contact, deep_overlap, 1},
      {20,
       "Resting jitter",
       "A block for 60 s; a stack of five soft (E = 1e8) or ten rigid cubes for 20 s",
       "after 5 s rms speed < 1 mm/s, vertical velocity flips < 1/s",
       Family::contact,
       resting,
       20,
       {{"islands that sleep", "a body at rest is stepped for ever"}}},
      {21, "Creep sink", "A block of 1 m^3 and 1000 kg on the ground; its sinking from 2 to 8 s", "< 1 mm in a minute",
       Family::contact, creep_sink, 2},
      {22,
       "Friction on a slope",
       "mu = 0.5 (26.57 degrees): 26.0 and 27.1 degrees, and 30 for the acceleration",
       "drift < 1 mm in 10 s at 26.0; slides at 27.1",
       Family::contact,
       slope,
       6,
       {heuristic, {"PID static friction", "the paper's controller; contact remembers tangential impulses instead"}}},
      {28,
       "Island merge, wake",
       "A chain of 20 blocks 1 mm apart, settled, the first pushed to 2 m/s",
       "no energy gain, no block left in the air",
       Family::contact,
       wake,
       5,
       {{"islands that sleep", "nothing sleeps, so nothing can be woken wrongly"}}},
  };
}

}  // namespace crumple::lab::stability
