#pragma once

#include "server/sim/fem/lane_matrix.h"
#include "server/sim/fem/rest_body.h"

// The co-rotated law of four elements at once, one in each lane of the vector unit. Lanes do not see each other.
namespace crumple::sim::fem {

// From four deformation gradients to rotations and stresses.
class QuadLaw {
 public:
  // tet_of(lane): a tet of the lane's material.
  void set_materials(const RestBody& rest, const auto& tet_of) {
    for (int lane = 0; lane < 4; ++lane) {
      const int t = tet_of(lane);
      const FemMaterial& m = rest.material_of(t);
      lambda_[lane] = rest.lame_of(t).lambda;
      mu_[lane] = rest.lame_of(t).mu;
      qr_[lane] = m.rotation == RotationRule::polar_qr ? -1 : 0;
      deviatoric_[lane] = m.flow == FlowRule::deviatoric ? -1 : 0;
    }
  }
  // False, and nothing of use done, if a lane needs a path of its own: QR, or F too near to singular for its polar factor.
  bool update(const QuadMatrix& F, const QuadMatrix& plastic_strain);

  Quad mu() const { return mu_; }
  Quad energy_density() const;  // of sigma, as energy_density_of_stress has it

  QuadMatrix Q, sigma;  // as Elements has them
  QuadMatrix stress;    // sigma and what balances the moment of the forces (moment_balance)

 private:
  Quad lambda_, mu_;
  Mask qr_{}, deviatoric_{};
};

}  // namespace crumple::sim::fem
