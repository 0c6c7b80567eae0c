"""Cases whose outcome is known without this program, and how well it meets them."""
