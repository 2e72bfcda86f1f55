"""Sources of finite size: the areas of their images, bounded by the images of their limbs."""
