#pragma once

#include "server/lab/stability/method.h"
#include "server/lab/stability/outcome.h"

#include <filesystem>
#include <functional>

namespace crumple::lab::stability {

// How much of a check is run: the regression part takes smaller meshes and fewer seeds.
struct Effort {
  bool brief = false;
  // Folder of the yardstick's cases, for what takes a mesh of it; empty or not there: the row says so and does the
  // rest. The regression part never has it, since its outcomes must not depend on it.
  std::filesystem::path references;
};

// What a row asks for and nobody has built.
struct Missing {
  std::string method;
  std::string what;
};

// One failure of the literature: a named check.
struct Row {
  int number = 0;
  std::string name, test, criterion;
  Family family = Family::world;
  // Runs the check for one method of the family. It may crash: callers run it in a process of its own.
  std::function<Outcome(const Method& method, const Effort& effort)> check;
  double seconds = 1;  // of the full check of one method, roughly, for the estimate
  std::vector<Missing> not_built;
  bool in_brief = true;  // part of the regression part
};

// The 41 rows, ascending.
const std::vector<Row>& all_rows();

// By field; all_rows() puts them together.
std::vector<Row> inversion_rows();      // 1 to 3, 6, 7
std::vector<Row> rotation_rule_rows();  // 4, 5
std::vector<Row> element_rows();        // 8, 9, 11
std::vector<Row> integration_rows();    // 10, 12 to 15
std::vector<Row> contact_rows();        // 16, 18 to 22, 28
std::vector<Row> fracture_rows();       // 23 to 27
std::vector<Row> example_rows();        // 29 to 34, 39, 40
std::vector<Row> rigid_rows();          // 35 to 38
std::vector<Row> server_rows();         // 17, 41

}  // namespace crumple::lab::stability
