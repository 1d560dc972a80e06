/* What hab_fit_workspace_bytes returns, for models whose vertices share no state and for arrays whose size a compiler must know; frame is one of hab_frame. */
#define HAB_FIT_WORKSPACE_BYTES(identity_dim, pose_dim, frame) \
    HAB_FIT_WORKSPACE_OF_((size_t)(identity_dim) + (size_t)(pose_dim), \
                          (size_t)(identity_dim) + (size_t)(pose_dim) + HAB_FRAME_DIM_(frame))
/* Bytes of workspace of a prepared form of a bilinear model, of n_blocks blocks, whose free mode has free_dim weights: what hab_prepared_workspace_bytes says. */
#define HAB_PREPARED_WORKSPACE_BYTES(free_dim, n_blocks) \
    (((size_t)(free_dim) + 1) * (size_t)(n_blocks) * 3 * HAB_BLOCK_VERTICES * sizeof(float))
/* Bytes that suffice for the workspace of an evaluation of a skinned model; hab_evaluation_workspace_bytes says how many of them a certain model needs. derivatives is 1 or 0. */
#define HAB_SKINNED_WORKSPACE_BYTES(identity_dim, pose_dim, n_joints, derivatives) \
    (sizeof(float) * ((size_t)(identity_dim) + (size_t)(pose_dim) + 29 * (size_t)(n_joints) + \
                      ((derivatives) ? (size_t)(n_joints) * (4 + 3 * (size_t)(identity_dim)) + 12 * (size_t)(pose_dim) : 0)))
/* Bytes that suffice for the workspace of a fit of a skinned model; hab_model_fit_workspace_bytes says how many of them a certain model needs. */
#define HAB_SKINNED_FIT_WORKSPACE_BYTES(identity_dim, pose_dim, n_joints, frame) \
    (HAB_FIT_WORKSPACE_BYTES(identity_dim, pose_dim, frame) + HAB_SKINNED_WORKSPACE_BYTES(identity_dim, pose_dim, n_joints, 1))

#define HAB_FRAME_DIM_(frame) ((frame) == HAB_FRAME_FIXED ? (size_t)0 : (frame) == HAB_FRAME_RIGID ? (size_t)6 : (size_t)7)
#define HAB_FIT_WORKSPACE_OF_(weights, all) \
    (sizeof(float) * (((all) + 8) / 8 * 8 * (24 + (all) + 1) + 54 * (weights) + 3 * (all) * (all) + 8 * (all)))
