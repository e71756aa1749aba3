#pragma once

#include "server/sim/example_based/example_state.h"
#include "server/sim/parallel_for.h"

#include <vector>

// Which of the example weights that give one and the same shape. With more examples than a place has ways to move, "the basis
// formed by the columns of J_i would be overcomplete and the mapping in Equation (8) would strike a balance between the input
// examples. It would be interesting to explore ways of computing the example weights in such underconstrained scenarios that
// satisfy secondary goals, such as smoothness of the example weights or favoring using a single example over an average of
// all examples" (Jones et al. 2016, section 6). Ours: once a body's shape has come to rest, the weights of the vertices that
// are dented move along the null space of J_i in the simplex's plane,
//   few_examples    towards what they are already, growing |E_i|^2, until a weight ends, and so on: where skinning is linear
//                   at most one more than the rank of J_i stay, whatever number there was (Caratheodory's theorem)
//   smooth_weights  towards the mean of their neighbours', each weighted by 1 / distance: sum_ij |E_i - E_j|^2 / distance falls
// and are put back onto the vertex' place by Newton's method where skinning is not linear. No vertex moves by more than
// goal_tolerance times the body's size from where it came to rest; rows stay in the simplex; rows that rest is all of stay.
namespace crumple::sim::example_based {

// Rows that are looked at in one step: some 10 us each. The work of a large body is spread over steps in this way.
inline constexpr int kGoalRows = 256;
inline constexpr int kSmoothPasses = 16;

// The shape has come to rest: from now on `pursue_goal` has something to do.
void begin_goal(const ExampleParameters& parameters, ExampleState& state);

// Looks at the next rows. `changed` receives the vertices whose row of E changed, ascending; their x is for the caller.
void pursue_goal(const ExampleRest& rest, const ExampleParameters& parameters, const ThreadPool& pool, ExampleState& state,
                 std::vector<int>& changed);

// Ends what is under way: new impulses have come.
void leave_goal(ExampleState& state);

}  // namespace crumple::sim::example_based
