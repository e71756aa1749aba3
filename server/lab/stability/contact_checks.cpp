#include "common/text.h"
#include "server/lab/stability/contact_trial.h"
#include "server/lab/stability/row.h"
#include "server/lab/stability/soft_trial.h"

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
  // The raw forms have the paper's rule for fast bodies; the default law has one of its own inside.
  const bool sixth_rule = method.contact.settings.raw_damping;
  const int phases = effort.brief ? 3 : 10;
  int cube = 0, disc = 0, bare = 0;
  bool sound = true;
  double rebound = 0;
  for (int k = 0; k < phases; ++k) {
    ShotOptions shot{.speed = 1000, .phase = static_cast<double>(k) / phases, .sixth_rule = sixth_rule};
    const Shot a = shot_at_plate(method.contact, shot);
    shot.size.y() = 0.01;
    shot.round = true;
    const Shot b = shot_at_plate(method.contact, shot);
    cube += a.behind;
    disc += b.behind;
    sound = sound && a.sound && b.sound;
    rebound = std::max({rebound, a.rebound, b.rebound});
    if (!sixth_rule) continue;
    shot = {.speed = 1000, .phase = shot.phase};
    bare += shot_at_plate(method.contact, shot).behind;
  }
  int through = 0;
  std::string spins;
  for (const double rate : {10.0, 30.0, 100.0}) {
    const Spun spun = spun_at_plate(method.contact, rate, 1.0 / 60, effort.brief ? 0.25 : 1);
    sound = sound && spun.sound;
    through += spun.through > 0;
    spins += text(" ", rate, " rad/s: ",
                  spun.deepest < 0 ? text("never, its spin is gone ", -1000 * spun.deepest, " mm before the plate;")
                                   : text(spun.through, " steps, ", 1000 * spun.deepest, " mm deep;"));
  }
  const std::string found =
      text("of ", phases, " shots at 1000 m/s a cube passes ", cube, ", a disc of 1 cm face-on ", disc,
           sixth_rule ? text(" (with the rule of a sixth of the diagonal; without it a cube passes ", bare, ")") : "",
           "; rebound up to ", rebound, " of the speed. A part of a spinning disc is behind the plate, at", spins);
  const double passed = (cube + disc) / (2.0 * phases) + through;
  if (sound && passed > 0) return {Verdict::fails, passed, found};
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
  double rms = 0;    // largest of any body after 5 s [m/s]
  double flips = 0;  // most sign changes of a body's vertical velocity above 0.1 mm/s [1/s]
  double drift = 0;  // of the last block from where it was at 5 s [m]
  double calm = 0;   // when a body was last faster than 1 mm/s [s]
};

Rest settle(ContactTrial& trial, double seconds) {
  trial.start();
  trial.run(5);
  const std::size_t count = trial.blocks.size();
  const Vec3 at = trial.centre(trial.blocks.back());
  std::vector<double> last(count, 0);
  std::vector<int> flips(count, 0);
  Rest result;
  trial.run(seconds - 5, [&](const sim::StepReport&) {
    for (std::size_t k = 0; k < count; ++k) {
      const double speed = trial.rms_speed(trial.blocks[k]);
      result.rms = std::max(result.rms, speed);
      if (speed > 1e-3) result.calm = trial.world->time();
      const double v = trial.velocity(trial.blocks[k]).y();
      if (std::abs(v) <= 1e-4) continue;
      flips[k] += v * last[k] < 0;
      last[k] = v;
    }
    return true;
  });
  result.sound = trial.sound();
  result.flips = std::ranges::max(flips) / (seconds - 5);
  result.drift = (trial.centre(trial.blocks.back()) - at).norm();
  return result;
}

Rest rest_of_stack(const Method& method, int high, double young, double seconds) {
  ContactTrial trial(method.contact);
  trial.add_ground();
  for (int k = 0; k < high; ++k) trial.add_block({.centre = {0, 0.5 + k, 0}, .young = young});
  return settle(trial, seconds);
}

// Cubes of half a metre in layers of 5 x 4, 4 x 3, 3 x 3, 3 x 2, 2 x 1 and one, each a little off its place and turned,
// 2 cm above what is below.
Rest rest_of_pile(const Method& method, int layers, double seconds) {
  constexpr std::array<std::array<int, 2>, 6> kLayers{{{5, 4}, {4, 3}, {3, 3}, {3, 2}, {2, 1}, {1, 1}}};
  constexpr double kEdge = 0.5, kPitch = 0.58;
  ContactTrial trial(method.contact);
  trial.add_ground();
  Random random(3);
  for (int layer = 0; layer < layers; ++layer)
    for (int i = 0; i < kLayers[layer][0]; ++i)
      for (int k = 0; k < kLayers[layer][1]; ++k) {
        const Vec3 place(kPitch * (i - 0.5 * (kLayers[layer][0] - 1)), 0.02 + 0.5 * kEdge + layer * (kEdge + 0.02),
                         kPitch * (k - 0.5 * (kLayers[layer][1] - 1)));
        const Vec3 off = random.vec3(-0.02, 0.02);
        trial.add_block({.size = Vec3::Constant(kEdge),
                         .centre = place + Vec3(off.x(), 0, off.z()),
                         .turned = 5 * off.y(),
                         .cells = {1, 1, 1},
                         .young = 1e7});
      }
  return settle(trial, seconds);
}

Outcome resting(const Method& method, const Effort& effort) {
  const Rest block = rest_of_stack(method, 1, 1e6, effort.brief ? 8 : 60),
             stack = rest_of_stack(method, 10, 1e8, effort.brief ? 6 : 60),
             pile = rest_of_pile(method, effort.brief ? 2 : 6, effort.brief ? 6 : 60);
  bool sound = true, holds = true;
  double worst = 0;
  std::string found;
  for (const auto& [name, rest] : {std::pair<std::string, Rest>{"block", block},
                                   {"stack of ten", stack},
                                   {effort.brief ? "pile of 32" : "pile of 50", pile}}) {
    sound = sound && rest.sound;
    holds = holds && rest.rms < 1e-3 && rest.flips < 1;
    worst = std::max(worst, rest.rms);
    found += text(found.empty() ? "" : "; ", name, ": rms speed up to ", 1000 * rest.rms, " mm/s",
                  rest.calm > 0 ? text(" (above 1 mm/s until ", rest.calm, " s)") : "", ", ", rest.flips,
                  " flips a second, the top one drifts ", 1000 * rest.drift, " mm");
  }
  return judged(sound, holds, worst, found);
}

Outcome creep_sink(const Method& method, const Effort& effort) {
  constexpr double kFormulaError = 0.01;
  ContactTrial trial(method.contact);
  trial.add_ground();
  const BodyId body = trial.add_block({.centre = {0, 0.4999, 0}, .young = 1e8});
  trial.start();
  const auto sinks = [&](double seconds) {
    const double from = trial.centre(body).y();
    trial.run(seconds);
    return std::max(0.0, from - trial.centre(body).y());
  };
  trial.run(2);
  // A block that sinks far tilts, too, and then has another section: the formula is for its start.
  const double early = effort.brief ? 1 : 6, first = sinks(early), later = effort.brief ? 0 : sinks(52);
  const double speed = (first + later) / (early + (effort.brief ? 0 : 52));
  std::string found = text("sinks at ", 1000 * first / early, " mm/s at first, ", 60e3 * speed, " mm in a minute");
  bool as_formula = true;
  if (method.contact.settings.raw_damping) {
    const double formula = 1000 * kGravity / method.contact.settings.phi;
    as_formula = std::abs(first / early - formula) < kFormulaError * formula;
    found += text("; m g/(phi A) = ", 1000 * formula, " mm/s", as_formula ? "" : ", which it should be within 1 %");
  }
  return judged(trial.sound(), 60 * speed < 1e-3 && as_formula, speed, found);
}

// A block on a slope of mu = 0.5 and what may happen to it. x is down the slope, y off it.
class OnSlope {
 public:
  OnSlope(const Method& method, double degrees)
      : trial_(method.contact), pull_(kGravity * std::sin(degrees * std::numbers::pi / 180)) {
    trial_.scene.gravity = {pull_, -kGravity * std::cos(degrees * std::numbers::pi / 180), 0};
    trial_.add_ground();
    trial_.add_block({.size = {1, 0.5, 1}, .centre = {0, 0.25, 0}, .young = 1e8});
    trial_.start();
  }

  bool sound() const { return trial_.sound(); }
  double place() const { return trial_.centre(body()).x(); }
  double speed() const { return trial_.velocity(body()).x(); }
  void wait(double seconds) { trial_.run(seconds); }
  // What it moves in the time, over ten seconds [m].
  double drift(double seconds) {
    const double from = place();
    trial_.run(seconds);
    return std::abs(place() - from) * 10 / seconds;
  }
  // Pushed to and fro along the slope with 0.3 m g at 5 Hz, thirty times what friction has to spare at 26 degrees.
  void shake(double seconds) {
    trial_.run(seconds, [&](const sim::StepReport&) {
      push({0.3 * kMass * kGravity * std::sin(2 * std::numbers::pi * 5 * trial_.world->time()), 0, 0});
      return true;
    });
  }
  // Struck off the slope at 0.2 m/s: in the air for three steps.
  void hop() {
    (void)trial_.world->submit(sim::ApplyImpulse{
        .body = body(), .impulse = {0, kMass * kHop, 0}, .point = trial_.centre(body()), .radius = 1});
  }
  // Largest speed in the time: up the slope, or, with the slope's pull held off by a force, either way.
  double kick(double seconds, bool held_off) {
    double fastest = 0;
    if (held_off) push({-kMass * pull_, 0, 0});
    trial_.run(seconds, [&](const sim::StepReport&) {
      fastest = std::max(fastest, held_off ? std::abs(speed()) : -speed());
      if (held_off) push({-kMass * pull_, 0, 0});
      return true;
    });
    return fastest;
  }

 private:
  BodyId body() const { return trial_.blocks[0]; }
  void push(const Vec3& force) {
    (void)trial_.world->submit(
        sim::ApplyForce{.body = body(), .force = force, .point = trial_.centre(body()), .radius = 1});
  }

  static constexpr double kMass = 500;  // [kg]
  static constexpr double kHop = 0.2;   // [m/s]

  ContactTrial trial_;
  double pull_;  // of gravity along the slope [m/s^2]
};

Outcome slope(const Method& method, const Effort& effort) {
  const double seconds = effort.brief ? 3 : 10, calm = 4;
  OnSlope holds(method, 26.0), slides(method, 27.1), steep(method, 30), shaken(method, 26.0), hopped(method, 26.0),
      reset(method, 26.0);
  holds.wait(2);
  const double drift = holds.drift(seconds);
  slides.wait(3);
  steep.wait(1);
  const double v = steep.speed();
  steep.wait(1);
  const double a = steep.speed() - v;

  // What a controller has stored of one state must not act in the next: after a shake, when the contact is made anew,
  // and when it is made anew where nothing is left to hold against.
  shaken.wait(1);
  shaken.shake(effort.brief ? 1 : 2);
  shaken.wait(0.1);
  const double kick_shaken = shaken.kick(calm, false), drift_shaken = shaken.drift(seconds);
  hopped.wait(1);
  hopped.hop();
  const double kick_hopped = hopped.kick(calm, false), drift_hopped = hopped.drift(seconds);
  reset.wait(1);
  reset.hop();
  const double kick_reset = reset.kick(1, true);

  const double worst_drift = std::max({drift, drift_shaken, drift_hopped}),
               kick = std::max({kick_shaken, kick_hopped, kick_reset});
  bool sound = true;
  for (const OnSlope* block : {&holds, &slides, &steep, &shaken, &hopped, &reset}) sound = sound && block->sound();
  const bool slid = slides.place() > 0.1;
  return judged(
      sound, worst_drift < 1e-3 && kick < 0.05 && slid, std::max(worst_drift / 1e-3, kick / 0.05),
      text("at 26.0 degrees drifts ", 1000 * drift, " mm in 10 s, ", 1000 * drift_shaken, " after shaking, ",
           1000 * drift_hopped, " after a hop; kicks up the slope ", kick_shaken, " m/s after shaking, ", kick_hopped,
           " after a hop, ", kick_reset, " where the pull is gone when it lands; at 27.1 slides ", slides.place(),
           " m in 3 s; at 30 accelerates ", a, " m/s^2 (0.657)"));
}

// With islands that sleep, unlike the other rows. First a chain, then a stack whose lowest block is shot away.
Outcome wake(const Method& method, const Effort& effort) {
  const auto settled = [&](int count, const auto& place) {
    ContactTrial trial(method.contact);
    trial.scene.sleep = {};
    trial.add_ground();
    for (int k = 0; k < count; ++k)
      trial.add_block({.size = Vec3::Constant(0.5), .centre = place(k), .cells = {1, 1, 1}, .young = 1e7});
    trial.start();
    trial.run(effort.brief ? 3 : 6, [&](const sim::StepReport& report) { return report.workload.live_bodies > 0; });
    return trial;
  };
  const auto push = [](ContactTrial& trial, BodyId body, double speed) {
    (void)trial.world->submit(sim::ApplyImpulse{
        .body = body, .impulse = {speed * 125, 0, 0}, .point = trial.centre(body), .radius = 1});  // 125 kg
  };
  const int count = effort.brief ? 8 : 20;
  ContactTrial chain = settled(count, [](int k) { return Vec3(0.501 * k, 0.25, 0); });
  const int slept = chain.world->workload().asleep_bodies;
  const double quiet = chain.energy();
  push(chain, chain.blocks[0], 2);
  chain.run(chain.scene.dt);
  const double poked = std::max(chain.energy(), quiet);
  double highest = poked;
  chain.run(3, [&](const sim::StepReport&) {
    highest = std::max(highest, chain.energy());
    return true;
  });
  const double gain = (highest - poked) / (0.5 * 125 * 2 * 2);
  bool airborne = false;
  for (const BodyId body : chain.blocks) airborne = airborne || chain.lowest(body) > 0.02;

  ContactTrial stack = settled(3, [](int k) { return Vec3(0, 0.25 + 0.5 * k, 0); });
  const int stack_slept = stack.world->workload().asleep_bodies;
  push(stack, stack.blocks[0], 12);
  stack.run(3);
  int low = 0;  // blocks on the ground: one of the two upper ones may have come to rest on another
  for (const BodyId body : stack.blocks) low += stack.lowest(body) < 0.02;
  airborne = airborne || low < 2 || stack.lowest(stack.blocks[2]) > 0.6;
  return judged(chain.sound() && stack.sound(), gain < 0.01 && !airborne, gain,
                text(slept, " of ", count, " blocks of the chain sleep before the poke, ", stack_slept,
                     " of 3 of the stack; energy rises by ", 100 * gain, " % of the poke's at most; ",
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
       "step; the disc 0.3 m above the plate, spinning about a diameter at 10 to 100 rad/s for 1 s",
       "never ends on the far side; no part of the spinning disc ends a step there",
       Family::contact,
       tunnelling,
       5,
       {{"continuous collision detection", "time of impact for soft bodies, and for turning ones of either kind"}}},
      {19, "Initial deep overlap", "Two cubes of 1 m overlapping by half, no gravity, 4 s",
       "fastest < 2 m/s, nothing inverted; damping contact never parts them", Family::contact, deep_overlap, 1},
      {20,
       "Resting jitter",
       "A block, a stack of ten cubes of 1 m (E = 1e8) and a pile of fifty of 0.5 m (E = 1e7) for 60 s",
       "after 5 s rms speed of every body < 1 mm/s, vertical velocity flips < 1/s",
       Family::contact,
       resting,
       100,
       {{"islands that sleep", "a body at rest is stepped for ever"}}},
      {21, "Creep sink", "A block of 1 m^3 and 1000 kg on the ground for 60 s; its sinking from 2 s on",
       "< 1 mm in a minute; raw damping: at first as m g/(phi A) within 1 %", Family::contact, creep_sink, 10},
      {22,
       "Friction on a slope",
       "mu = 0.5 (26.57 degrees): 26.0 and 27.1 degrees, and 30 for the acceleration; at 26.0 shaken along the slope "
       "by 0.3 "
       "g at 5 Hz, struck off it, and struck off it with the pull of the slope taken away when it lands",
       "drift < 1 mm in 10 s at 26.0, also after shaking and landing; no kick above 0.05 m/s; slides at 27.1",
       Family::contact,
       slope,
       15,
       {heuristic, {"PID static friction", "the paper's controller; contact remembers tangential impulses instead"}}},
      {28,
       "Island merge, wake",
       "A chain of 20 blocks 1 mm apart, asleep, the first pushed to 2 m/s; a stack of three asleep, the lowest shot away",
       "no energy gain, no block left in the air",
       Family::contact,
       wake,
       5},
  };
}

}  // namespace crumple::lab::stability
