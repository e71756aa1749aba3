#include "server/sim/contact/contact_rows.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>

namespace crumple::sim::contact {
namespace {

// Bodies: 0 soft of 6 nodes (blocks 0..5), 1 soft of 5 nodes (blocks 6..10), 2 rigid (blocks 11, 12), 3 fixed.
const std::vector<int> kFirstBlock{0, 6, 11, -1};
constexpr int kBlocks = 13;

Vec3 random_vector(std::mt19937& random) {
  std::normal_distribution<double> g;
  const double x = g(random), y = g(random), z = g(random);
  return {x, y, z};
}

ContactSide soft_side(int body, double sign, std::array<int, 4> nodes, std::mt19937& random) {
  std::uniform_real_distribution<double> u(0.1, 1);
  ContactSide side;
  side.body = body;
  side.node_count = 4;
  side.nodes = nodes;
  double sum = 0;
  for (double& w : side.weights) sum += w = u(random);
  for (double& w : side.weights) w *= sign / sum;
  return side;
}

std::vector<ContactRow> some_rows(std::mt19937& random) {
  std::vector<ContactRow> rows(30);
  for (int k = 0; k < 30; ++k) {
    ContactRow& row = rows[k];
    row.normal = random_vector(random).normalized();
    row.point = random_vector(random);
    row.c_n = 3 + k;
    row.c_t = 0.4 * k;
    row.target = 0.1 * k;
    row.t0 = random_vector(random);
    row.sides[0] = soft_side(0, 1, {0, 1 + k % 2, 3, 5}, random);
    if (k % 3 == 0) {
      row.sides[1] = soft_side(1, -1, {0, 1, 2, 4}, random);
    } else if (k % 3 == 1) {
      row.sides[1].body = 2;
      row.sides[1].rigid = true;
      row.sides[1].arm = row.point - Vec3(1, 2, 3);
    } else {
      row.sides[1].body = 3;
      row.known_velocity = random_vector(random);
    }
  }
  return rows;
}

Eigen::MatrixXd dense(const ContactRows& rows) {
  const ThreadPool pool(1);
  Eigen::MatrixXd A(3 * kBlocks, 3 * kBlocks);
  for (int i = 0; i < 3 * kBlocks; ++i) {
    Eigen::VectorXd y = Eigen::VectorXd::Zero(3 * kBlocks);
    rows.apply_add(Eigen::VectorXd::Unit(3 * kBlocks, i), y, pool);
    A.col(i) = y;
  }
  return A;
}

TEST(ContactRows, AreSymmetricPositiveSemiDefinite) {
  std::mt19937 random(1);
  std::vector<ContactRow> rows = some_rows(random);
  for (int k = 0; k < 30; ++k) {  // each alone, then all
    const Eigen::MatrixXd A = dense(ContactRows(std::span(rows).subspan(k, 1), kFirstBlock, kBlocks));
    EXPECT_LT((A - A.transpose()).norm(), 1e-12);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(A).eigenvalues().minCoeff(), -1e-11);
  }
  const Eigen::MatrixXd A = dense(ContactRows(rows, kFirstBlock, kBlocks));
  EXPECT_LT((A - A.transpose()).norm(), 1e-11);
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(A).eigenvalues().minCoeff(), -1e-10);
}

TEST(ContactRows, OfTwoSoftBodiesAreThePapersBlocks) {
  std::mt19937 random(4);
  std::vector<ContactRow> rows = some_rows(random);
  rows.resize(1);
  rows[0].c_t = 0;
  const Eigen::MatrixXd A = dense(ContactRows(rows, kFirstBlock, kBlocks));
  const Vec3 n = rows[0].normal;
  for (const ContactSide& s : rows[0].sides)
    for (const ContactSide& q : rows[0].sides)
      for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) {
          const Mat3 expected = rows[0].c_n * s.weights[i] * q.weights[j] * n * n.transpose();  // phi |r| b_i b_j r^ r^T
          const Mat3 block = A.block<3, 3>(3 * (kFirstBlock[s.body] + s.nodes[i]), 3 * (kFirstBlock[q.body] + q.nodes[j]));
          EXPECT_LT((block - expected).norm(), 1e-14);
        }
}

TEST(ContactRows, DiagonalIsThatOfTheMatrix) {
  std::mt19937 random(2);
  std::vector<ContactRow> rows = some_rows(random);
  const ContactRows system(rows, kFirstBlock, kBlocks);
  const Eigen::MatrixXd A = dense(system);
  std::vector<Mat3> blocks(kBlocks, Mat3::Zero());
  system.add_to_diagonal(blocks, ThreadPool(1));
  for (int b = 0; b < kBlocks; ++b) EXPECT_LT((blocks[b] - A.block<3, 3>(3 * b, 3 * b)).norm(), 1e-11);
}

TEST(ContactRows, ForceOfTheMatrixAndRightHandSideIsTheRowsImpulse) {
  std::mt19937 random(6);
  std::vector<ContactRow> rows = some_rows(random);
  rows[4].active = false;
  const ContactRows system(rows, kFirstBlock, kBlocks);
  const ThreadPool pool(1);
  Eigen::VectorXd x(3 * kBlocks);
  for (int b = 0; b < kBlocks; ++b) x.segment<3>(3 * b) = random_vector(random);
  Eigen::VectorXd force = Eigen::VectorXd::Zero(3 * kBlocks), rhs = force, expected = force;
  system.apply_add(x, force, pool);
  system.add_to_rhs(rhs, ThreadPool(1));
  for (int k = 0; k < 30; ++k) {
    const ContactRow& row = rows[k];
    if (!row.active) continue;
    const Vec3 u = system.relative_velocity(k, x), n = row.normal;
    const Vec3 lambda = row.c_n * (row.target - n.dot(u)) * n + row.t0 - row.c_t * (u - n.dot(u) * n);
    for (const ContactSide& s : row.sides)
      for (int i = 0; i < s.node_count; ++i) expected.segment<3>(3 * (kFirstBlock[s.body] + s.nodes[i])) += s.weights[i] * lambda;
    if (!row.sides[1].rigid) continue;
    expected.segment<3>(33) -= lambda;
    expected.segment<3>(36) -= row.sides[1].arm.cross(lambda);
  }
  EXPECT_LT((rhs - force - expected).norm(), 1e-10);
}

TEST(ContactRows, SeeTheVelocityOfARigidBodysPoint) {
  std::mt19937 random(8);
  std::vector<ContactRow> rows = some_rows(random);
  const ContactRows system(rows, kFirstBlock, kBlocks);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(3 * kBlocks);
  const Vec3 v = random_vector(random), w = random_vector(random);
  x.segment<6>(33) << v, w;
  EXPECT_LT((system.relative_velocity(1, x) + v + w.cross(rows[1].sides[1].arm)).norm(), 1e-14);
}

TEST(ContactRows, BitsDoNotDependOnThreads) {
  std::mt19937 random(3);
  std::vector<ContactRow> rows;
  for (int k = 0; k < 40; ++k) std::ranges::copy(some_rows(random), std::back_inserter(rows));  // several chunks
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(3 * kBlocks, -1, 1);
  Eigen::VectorXd sum[2] = {x, x}, rhs[2] = {x, x};
  std::vector<Mat3> diagonal[2];
  for (int k = 0; k < 2; ++k) {
    const ThreadPool pool(k + 1);
    ContactRows system;
    system.assign(rows, kFirstBlock, kBlocks);
    system.refresh(pool);
    system.apply_add(x, sum[k], pool);
    system.add_to_rhs(rhs[k], pool);
    diagonal[k].assign(kBlocks, Mat3::Identity());
    system.add_to_diagonal(diagonal[k], pool);
  }
  EXPECT_EQ(sum[0], sum[1]);
  EXPECT_EQ(rhs[0], rhs[1]);
  EXPECT_EQ(diagonal[0], diagonal[1]);
}

}  // namespace
}  // namespace crumple::sim::contact
